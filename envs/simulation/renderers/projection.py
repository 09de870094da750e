"""From faces in the world to convex polygons in the image, with what varies over them.

On a flat face the inverse depth w = 1/z is affine in the pixel (x, y), and so is every attribute
a once divided by depth: a(x, y) = (A . (x, y, 1)) / w(x, y) + a0. The nine plus two numbers of a
face are all that rasterising and texturing need (Blinn, "Hyperbolic interpolation", IEEE CG&A
1992), and the texture's derivatives follow from them exactly.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from grouser.envs.simulation.renderers.visible import MAX_CORNERS, U, V, W
from grouser.geometry import Array
from grouser.kernels import kernel


class View(NamedTuple):
    """A camera at a pose, as kernels take it."""

    T_world_camera: Array
    intrinsics: Array
    """(4,) fx, fy, cx, cy, px."""
    size: Array
    """(2,) width and height, px."""
    near: float
    """What is nearer than this is cut off, m."""
    samples_a_pixel: float
    """Along an axis, evenly spaced and symmetric about a pixel's centre: 1 or 4."""


@kernel
def project_faces(corners: Any, uv: Any, shade: Any, labels: Any, chunks: Any, view: Any,
                  visible: Any, n: int) -> int:  # fmt: skip
    """Append every face that may show to the n polygons there are; the number there are then.

    Args:
        corners: (F, 4, 3) m, world frame.
        uv: (F, 4, 2) texture coordinates of the corners.
        shade: (F, 3) of the faces.
        labels: (F, 3) texture, object and surface of the faces.
        chunks: (C, 6) of faces that follow one another: the first, one past the last, and the
            sphere around them, centre and radius, m.
        view: a `View`.
        visible: a `Visible` with room for all.
    """
    camera, clipped = np.empty((4, 3)), np.empty((MAX_CORNERS, 3))
    for c in range(chunks.shape[0]):
        if not sphere_in_view(chunks[c, 2], chunks[c, 3], chunks[c, 4], chunks[c, 5], view):
            continue
        for i in range(int(chunks[c, 0]), int(chunks[c, 1])):
            for k in range(4):
                to_camera(corners[i, k, 0], corners[i, k, 1], corners[i, k, 2], view, camera[k])
            if faces_camera(camera) and project_polygon(camera, view, clipped, visible, n):
                write_planes(camera, uv[i], view.intrinsics, visible, n)
                for q in range(3):
                    visible.shade[n, q] = shade[i, q]
                visible.texture[n] = labels[i, 0]
                visible.object[n] = labels[i, 1]
                visible.surface[n] = labels[i, 2]
                n += 1
    return n


@kernel
def to_camera(x: float, y: float, z: float, view: Any, out: Any) -> None:
    """A point of the world in the camera frame."""
    T = view.T_world_camera
    dx, dy, dz = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    for c in range(3):
        out[c] = T[0, c] * dx + T[1, c] * dy + T[2, c] * dz


@kernel
def sphere_in_view(x: float, y: float, z: float, radius: float, view: Any) -> bool:
    """Whether a sphere reaches into the camera's pyramid, as far as its five planes tell."""
    T, intrinsics = view.T_world_camera, view.intrinsics
    dx, dy, dz = x - T[0, 3], y - T[1, 3], z - T[2, 3]
    depth = T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz
    if depth < view.near - radius:
        return False
    for axis in range(2):
        aside = T[0, axis] * dx + T[1, axis] * dy + T[2, axis] * dz
        f, c = intrinsics[axis], intrinsics[2 + axis]
        low, high = (c + 1) / f, (view.size[axis] - c) / f
        if aside + low * depth < -radius * math.sqrt(1 + low * low):
            return False
        if aside - high * depth > radius * math.sqrt(1 + high * high):
            return False
    return True


@kernel
def _normal(p: Any) -> Any:
    """The face's normal in the camera frame (not of unit length), out of the side that shows."""
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[3, 0] - p[0, 0], p[3, 1] - p[0, 1], p[3, 2] - p[0, 2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def faces_camera(p: Any) -> bool:
    """Whether the side that shows of corners (4, 3) in the camera frame is turned to it."""
    nx, ny, nz = _normal(p)
    return bool(nx * p[0, 0] + ny * p[0, 1] + nz * p[0, 2] < -1e-12)


@kernel
def project_polygon(camera: Any, view: Any, clipped: Any, visible: Any, n: int) -> bool:
    """Write the corners of the n-th polygon, by way of `clipped` (MAX_CORNERS, 3); whether it may
    cover a sample of the image."""
    count = _clip_near(camera, view.near, clipped)
    if count < 3:
        return False
    intrinsics, polygon = view.intrinsics, visible.polygons[n]
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        x = intrinsics[0] * clipped[k, 0] / clipped[k, 2] + intrinsics[2]
        y = intrinsics[1] * clipped[k, 1] / clipped[k, 2] + intrinsics[3]
        polygon[k, 0], polygon[k, 1] = x, y
        left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
    visible.n_corners[n] = count
    return bool(meets_samples(left, right, top, bottom, view))


@kernel
def meets_samples(left: float, right: float, top: float, bottom: float, view: Any) -> bool:
    """Whether a box in the image has a row and a column of samples in it.

    The rotated grid of four has one sample in each of four rows and columns a pixel.
    """
    if right <= -0.5 or bottom <= -0.5 or left >= view.size[0] or top >= view.size[1]:
        return False
    s = view.samples_a_pixel
    shift = 0.5 * (s - 1) - np.floor(0.5 * (s - 1))  # of the grid, in its own units
    across = np.floor(s * right - shift) >= np.ceil(s * left - shift)
    down = np.floor(s * bottom - shift) >= np.ceil(s * top - shift)
    return bool(across and down)


@kernel
def _clip_near(p: Any, near: float, out: Any) -> int:
    """Sutherland-Hodgman against the plane z = near; the number of corners left.

    An edge is cut from its near end, whichever way it is walked: the two faces on it agree to the
    last bit, and no crack shows between them.
    """
    n = 0
    for k in range(4):
        a, b = p[k], p[(k + 1) % 4]
        if a[2] >= near:
            out[n, 0], out[n, 1], out[n, 2] = a[0], a[1], a[2]
            n += 1
        if (a[2] >= near) != (b[2] >= near):
            lower, upper = (a, b) if a[2] < b[2] else (b, a)
            s = (near - lower[2]) / (upper[2] - lower[2])
            out[n, 0] = lower[0] + s * (upper[0] - lower[0])
            out[n, 1] = lower[1] + s * (upper[1] - lower[1])
            out[n, 2] = near
            n += 1
    return n


@kernel
def write_planes(p: Any, uv: Any, intrinsics: Any, visible: Any, n: int) -> None:
    """The affine functions of the pixel behind w, u and v (module docstring), from corners 0, 1
    and 3."""
    out = visible.planes[n]
    nx, ny, nz = _normal(p)
    d = nx * p[0, 0] + ny * p[0, 1] + nz * p[0, 2]
    _pixel_plane(nx / d, ny / d, nz / d, intrinsics, out, W)
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[3, 0] - p[0, 0], p[3, 1] - p[0, 1], p[3, 2] - p[0, 2]
    aa, ab, bb = (
        ax * ax + ay * ay + az * az,
        ax * bx + ay * by + az * bz,
        bx * bx + by * by + bz * bz,
    )
    determinant = aa * bb - ab * ab
    for q in range(2):
        along_a, along_b = uv[1, q] - uv[0, q], uv[3, q] - uv[0, q]
        s = (bb * along_a - ab * along_b) / determinant
        t = (aa * along_b - ab * along_a) / determinant
        gx, gy, gz = s * ax + t * bx, s * ay + t * by, s * az + t * bz  # gradient on the face
        start = U + (V - U) * q
        _pixel_plane(gx, gy, gz, intrinsics, out, start)
        out[start + 3] = uv[0, q] - (gx * p[0, 0] + gy * p[0, 1] + gz * p[0, 2])
    for k in range(out.size):
        visible.planes32[n, k] = np.float32(out[k])


@kernel
def _pixel_plane(gx: float, gy: float, gz: float, intrinsics: Any, out: Any, start: int) -> None:
    """g . (X, Y, 1) of the ray's direction, as a function of the pixel."""
    kx, ky = gx / intrinsics[0], gy / intrinsics[1]
    out[start], out[start + 1] = kx, ky
    out[start + 2] = gz - kx * intrinsics[2] - ky * intrinsics[3]
