"""From faces in the world to convex polygons in the image, with what varies over them.

On a flat face the inverse depth w = 1/z is affine in the pixel (x, y), and so is every attribute
a once divided by depth: a(x, y) = (A . (x, y, 1)) / w(x, y) + a0. The nine plus two numbers of a
face are all that rasterising and texturing need (Blinn, "Hyperbolic interpolation", IEEE CG&A
1992), and the texture's derivatives follow from them exactly.
"""

from typing import Any, Final

import numpy as np

from grouser.kernels import kernel

MAX_CORNERS: Final = 5
"""A quadrilateral clipped by one plane has at most five corners."""

W, U, V = 0, 3, 7
"""Where the coefficients of w (3), of u (3 and its constant) and of v (3 and its constant) begin
in a row of `planes`."""
N_PLANES: Final = 11


@kernel
def project_faces(
    corners: Any,
    uv: Any,
    T_world_camera: Any,
    intrinsics: Any,
    size: Any,
    near: float,
    polygons: Any,
    n_corners: Any,
    planes: Any,
) -> None:
    """Project every face that shows.

    Args:
        corners: (F, 4, 3) m, world frame.
        uv: (F, 4, 2) texture coordinates of the corners.
        T_world_camera: (4, 4).
        intrinsics: (4,) fx, fy, cx, cy, px.
        size: (2,) width and height, px.
        near: what is nearer than this is cut off, m.
        polygons: out, (F, MAX_CORNERS, 2) px.
        n_corners: out, (F,) corners in use; 0 where the face does not show.
        planes: out, (F, N_PLANES).
    """
    camera = np.empty((4, 3))
    clipped = np.empty((MAX_CORNERS, 3))
    for i in range(corners.shape[0]):
        n_corners[i] = 0
        _to_camera(corners[i], T_world_camera, camera)
        if not _faces_camera(camera):
            continue
        n = _clip_near(camera, near, clipped)
        if n < 3 or not _project(clipped, n, intrinsics, size, polygons[i]):
            continue
        _planes(camera, uv[i], intrinsics, planes[i])
        n_corners[i] = n


@kernel
def _to_camera(corners: Any, T: Any, out: Any) -> None:
    for k in range(4):
        dx, dy, dz = corners[k, 0] - T[0, 3], corners[k, 1] - T[1, 3], corners[k, 2] - T[2, 3]
        for c in range(3):
            out[k, c] = T[0, c] * dx + T[1, c] * dy + T[2, c] * dz


@kernel
def _normal(p: Any) -> Any:
    """The face's normal in the camera frame (not of unit length), out of the side that shows."""
    ax, ay, az = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    bx, by, bz = p[3, 0] - p[0, 0], p[3, 1] - p[0, 1], p[3, 2] - p[0, 2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def _faces_camera(p: Any) -> Any:
    """Whether the side that shows is turned to the camera."""
    nx, ny, nz = _normal(p)
    return nx * p[0, 0] + ny * p[0, 1] + nz * p[0, 2] < -1e-12


@kernel
def _clip_near(p: Any, near: float, out: Any) -> int:
    """Sutherland-Hodgman against the plane z = near; the number of corners left."""
    n = 0
    for k in range(4):
        a, b = p[k], p[(k + 1) % 4]
        if a[2] >= near:
            out[n, 0], out[n, 1], out[n, 2] = a[0], a[1], a[2]
            n += 1
        if (a[2] >= near) != (b[2] >= near):
            s = (near - a[2]) / (b[2] - a[2])
            out[n, 0], out[n, 1], out[n, 2] = (
                a[0] + s * (b[0] - a[0]),
                a[1] + s * (b[1] - a[1]),
                near,
            )
            n += 1
    return n


@kernel
def _project(p: Any, n: int, intrinsics: Any, size: Any, polygon: Any) -> bool:
    """Corners in pixels; whether their bounding box meets the image."""
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    for k in range(n):
        x = intrinsics[0] * p[k, 0] / p[k, 2] + intrinsics[2]
        y = intrinsics[1] * p[k, 1] / p[k, 2] + intrinsics[3]
        polygon[k, 0], polygon[k, 1] = x, y
        left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
    return right > -1 and bottom > -1 and left < size[0] and top < size[1]


@kernel
def _planes(p: Any, uv: Any, intrinsics: Any, out: Any) -> None:
    """The affine functions of the pixel behind w, u and v (module docstring)."""
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


@kernel
def _pixel_plane(gx: float, gy: float, gz: float, intrinsics: Any, out: Any, start: int) -> None:
    """g . (X, Y, 1) of the ray's direction, as a function of the pixel."""
    kx, ky = gx / intrinsics[0], gy / intrinsics[1]
    out[start], out[start + 1] = kx, ky
    out[start + 2] = gz - kx * intrinsics[2] - ky * intrinsics[3]
