"""How good the simulated images are for what estimators do with them, on 100 frames of a drive.

A plain visual odometry of OpenCV's parts alone (none of ours, so that neither hides the other's
faults) must find the motion between frames; and textures must not shimmer.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, inverse_transform, lift, transform
from grouser.rig import camera_mount
from grouser.scripts.benchmark_timing import Figures, Measurement

_SEED = 0
_CAMERA = Pinhole.with_field_of_view(320, 240, np.radians(66))
_BASELINE = 0.12  # m
_MOUNT = camera_mount(0.0, _BASELINE / 2, 0.40, pitch=np.radians(8))
_TO_RIGHT = transform(np.eye(3), [_BASELINE, 0, 0])
_DT = 0.1  # s
_DRIVE = ((30, 0.5, 0.0), (25, 0.4, 0.35), (15, 0.0, -0.5), (20, 0.5, -0.25), (10, 0.5, 0.0))
"""Frames, forward speed [m/s] and yaw rate [rad/s]: straight, arcs and a turn on the spot."""

Image = NDArray[np.uint8]
Points = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What the stereo camera sees from one pose."""

    T_world_camera: Array
    left: Image
    right: Image
    depth: NDArray[np.float32]
    """Of the left image, m."""


def image_quality(renderer: str = "raster") -> Figures:
    """The figures of images, medians over the drive's frames."""
    seen = drive(renderer)
    pairs = list(zip(seen[:-1], seen[1:], strict=True))
    found = [_pose_errors(*pair, seed) for seed, pair in enumerate(pairs)]
    rotation, translation, matches = np.median(np.array(found), axis=0)
    return {
        "images.pnp_rotation_deg": (float(np.degrees(rotation)), "deg"),
        "images.pnp_translation_mm": (float(1e3 * translation), "mm"),
        "images.stereo_matches": (float(matches), "matches"),
        "images.shimmer_percent": (100 * float(np.median([shimmer(*p) for p in pairs])), "%"),
    }


MEASUREMENTS = (
    Measurement(
        image_quality,
        (
            "images.pnp_rotation_deg",
            "images.pnp_translation_mm",
            "images.stereo_matches",
            "images.shimmer_percent",
        ),
    ),
)


def drive(name: str) -> list[Frame]:
    """100 frames, 0.1 s apart, in the yard, without noise."""
    world = make_world("yard", np.random.default_rng(_SEED))
    renderer = make_renderer(name, world, _CAMERA, color=False)
    frames = [_frame(renderer, T) for T in _poses(world)]
    renderer.close()
    return frames


def _frame(renderer: Renderer, T_world_camera: Array) -> Frame:
    left, right = renderer.images([T_world_camera, T_world_camera @ _TO_RIGHT])
    return Frame(T_world_camera, left[..., 0], right[..., 0], renderer.depth(T_world_camera))


def _poses(world: World) -> list[Array]:
    poses, pose = [], lift(world.start)
    for n, speed, rate in _DRIVE:
        half = lift([0, 0, rate * _DT / 2])
        for _ in range(n):
            poses.append(pose @ _MOUNT)
            pose = pose @ half @ lift([speed * _DT, 0, 0]) @ half
    return poses


def shimmer(first: Frame, second: Frame) -> float:
    """How much textures change that should only move, as a share of their contrast.

    The second left image is warped onto the first by the true depth and motion (bicubic). Of the
    pixels whose depth the second frame confirms to 2 %, and which are no sky and at least 2 px
    away from a jump of depth, the mean absolute difference to the first image is divided by the
    first image's standard deviation there. Interpolation alone leaves some percent of it; texture
    that is sampled without mip-maps, several times that.
    """
    T_second_first = inverse_transform(second.T_world_camera) @ first.T_world_camera
    y, x = np.mgrid[0 : _CAMERA.height, 0 : _CAMERA.width].astype(np.float64)
    solid = np.isfinite(first.depth)
    z = np.where(solid, first.depth, 1.0)
    points = _points(x, y, z) @ T_second_first[:3, :3].T + T_second_first[:3, 3]
    to_x = (_CAMERA.fx * points[..., 0] / points[..., 2] + _CAMERA.cx).astype(np.float32)
    to_y = (_CAMERA.fy * points[..., 1] / points[..., 2] + _CAMERA.cy).astype(np.float32)
    warped = cv2.remap(second.left, to_x, to_y, cv2.INTER_CUBIC).astype(np.float64)
    there = cv2.remap(second.depth, to_x, to_y, cv2.INTER_NEAREST)
    inside = (to_x > 2) & (to_y > 2) & (to_x < _CAMERA.width - 3) & (to_y < _CAMERA.height - 3)
    confirmed = solid & inside & (np.abs(there - points[..., 2]) < 0.02 * points[..., 2])
    steady = cv2.erode(confirmed.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    before = first.left.astype(np.float64)
    return float(np.abs(warped - before)[steady].mean() / before[steady].std())


def _pose_errors(first: Frame, second: Frame, seed: int) -> tuple[float, float, int]:
    """Error of the motion between two frames by stereo, tracking and PnP: rotation [rad],
    translation [m]; and how many stereo matches the first frame gave."""
    corners, in_right = _stereo_matches(first.left, first.right)
    in_right, seen = _tracked(first.left, first.right, corners, in_right)
    offset = corners - in_right
    stereo = seen & (offset[:, 0] > 0.5) & (np.abs(offset[:, 1]) < 0.5)
    in_second, followed = _tracked(first.left, second.left, corners, corners)
    both = stereo & followed
    x, y = corners[both].T.astype(np.float64)
    points = _points(x, y, _CAMERA.fx * _BASELINE / offset[both, 0].astype(np.float64))
    cv2.setRNGSeed(seed)
    found, rotation, translation, inliers = cv2.solvePnPRansac(
        points, in_second[both].astype(np.float64), _matrix(), None,
        iterationsCount=200, reprojectionError=1.0, flags=cv2.SOLVEPNP_ITERATIVE,
    )  # fmt: skip
    if not found:
        raise RuntimeError("visual odometry found no motion between two frames of the drive")
    chosen = inliers[:, 0]
    rotation, translation = cv2.solvePnPRefineLM(
        points[chosen], in_second[both][chosen].astype(np.float64), _matrix(), None,
        rotation, translation,
    )  # fmt: skip
    T = transform(cv2.Rodrigues(rotation)[0], translation[:, 0])
    true = inverse_transform(second.T_world_camera) @ first.T_world_camera
    error = inverse_transform(true) @ T
    angle = np.linalg.norm(cv2.Rodrigues(error[:3, :3])[0])
    return float(angle), float(np.linalg.norm(error[:3, 3])), len(corners)


def _stereo_matches(left: Image, right: Image) -> tuple[Points, Points]:
    """(n, 2) where 1000 ORB corners are in both eyes: mutually best matches on one row (to
    1.5 px) with a disparity from 0 to 60 px."""
    orb = cv2.ORB.create(1000)
    (in_left, of_left), (in_right, of_right) = (
        orb.detectAndCompute(image, None) for image in (left, right)
    )
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(of_left, of_right)
    one = np.array([in_left[m.queryIdx].pt for m in matches], dtype=np.float32)
    other = np.array([in_right[m.trainIdx].pt for m in matches], dtype=np.float32)
    offset = one - other
    fits = (np.abs(offset[:, 1]) < 1.5) & (offset[:, 0] > 0) & (offset[:, 0] < 60)
    return one[fits], other[fits]


def _tracked(
    one: Image, other: Image, points: Points, guess: Points
) -> tuple[Points, NDArray[np.bool_]]:
    """Lucas and Kanade's places of points (n, 2) in another image, and whether tracking back
    agrees to 0.3 px."""
    there, found, _ = _flow(one, other, points, guess)
    back, found_back, _ = _flow(other, one, there, points)
    near = np.linalg.norm(back - points, axis=-1) < 0.3
    return there, near & (found[:, 0] == 1) & (found_back[:, 0] == 1)


def _flow(one: Image, other: Image, points: Points, guess: Points) -> tuple[Points, Any, Any]:
    return cv2.calcOpticalFlowPyrLK(
        one, other, points, guess.copy(), winSize=(15, 15), maxLevel=2,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )  # fmt: skip


def _points(x: Array, y: Array, depth: Array) -> Array:
    """(..., 3) in the camera frame."""
    c = _CAMERA
    return np.stack([(x - c.cx) / c.fx * depth, (y - c.cy) / c.fy * depth, depth], axis=-1)


def _matrix() -> Array:
    c = _CAMERA
    return np.array([[c.fx, 0, c.cx], [0, c.fy, c.cy], [0, 0, 1]])
