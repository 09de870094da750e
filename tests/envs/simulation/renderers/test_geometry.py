"""Depth and segmentation agree with the world's geometry, to rounding; so do their edges."""

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import RENDERERS, make_renderer
from grouser.envs.simulation.world import Boxes, Cylinders, World
from grouser.geometry import Array, inverse_transform, lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.opengl_here import needs_opengl
from tests.envs.simulation.renderers.scenes import one_box, pixels

CAMERA = Pinhole.with_field_of_view(160, 120, np.radians(66))
FINE = Pinhole.with_field_of_view(2560, 1920, np.radians(66))
FX_320 = Pinhole.with_field_of_view(320, 240, np.radians(66)).fx
AS_OF_320 = FINE.fx / FX_320
MOUNT = camera_mount(0.0, 0.0, 0.5, pitch=np.radians(12))
NAMES = [pytest.param(n, marks=[needs_opengl] if n == "opengl" else []) for n in RENDERERS]
GROUND, FIRST = 1, 2


def hills(rows: int = 24, columns: int = 20, cell: float = 0.4) -> Ground:
    """Waves of 10 cm, higher and lower than the level around."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1] * cell
    heights = 0.1 * np.sin(1.3 * x) * np.cos(0.9 * y) + 0.05 * np.sin(2.9 * y + x)
    material = (np.indices((rows, columns)).sum(axis=0) // 4) % 3
    return Ground(heights, material, cell, np.array([-1.0, -4.5]))


def world(
    ground: Ground,
    solids: Boxes | None = None,
    cylinders: Cylinders | None = None,
    slabs: Boxes | None = None,
) -> World:
    return World(
        name="test",
        solids=solids or Boxes.none(),
        n_walls=0,
        ground=ground,
        start=np.zeros(3),
        clear_radius=0.0,
        cylinders=cylinders or Cylinders.none(),
        slabs=slabs or Boxes.none(),
    )


def post(x: float, y: float, radius: float, half_height: float = 0.6) -> Cylinders:
    return Cylinders(
        np.array([[x, y, half_height]]), np.array([radius]), np.array([half_height]), np.array([10])
    )


def renderer(name: str, of: World, camera: Pinhole = CAMERA) -> Renderer:
    return make_renderer(name, of, camera, color=False)


def rays_of(camera: Pinhole) -> Array:
    """(height, width, 3) of the pixels, of depth 1."""
    y, x = np.mgrid[0.0 : camera.height, 0.0 : camera.width]
    x, y = (x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy
    return np.stack([x, y, np.ones(x.shape)], axis=-1)


def points_behind(depth: NDArray[np.float32], T: Array, camera: Pinhole) -> Array:
    """(height, width, 3) what the pixels' centres show, in the world."""
    z = np.where(np.isfinite(depth), depth, 0).astype(np.float64)
    return np.asarray(rays_of(camera) * z[..., None] @ T[:3, :3].T + T[:3, 3])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0])
def test_depth_of_level_ground_is_that_of_a_plane(name: str, heading: float) -> None:
    T = lift([0.3, -0.2, heading]) @ MOUNT
    depth = renderer(name, world(Ground.flat(5.0))).depth(T)
    falling = -(rays_of(CAMERA) @ T[2, :3])
    expected = T[2, 3] / np.where(falling > 0, falling, np.nan)
    near = np.nan_to_num(expected, nan=np.inf) < 20
    assert depth.dtype == np.float32 and near.mean() > 0.5
    np.testing.assert_allclose(depth[near], expected[near], rtol=2e-5 if name == "opengl" else 2e-7)
    assert np.all(np.isinf(depth[falling <= 0]))


@pytest.mark.parametrize("name", NAMES)
def test_what_depth_shows_of_hills_lies_on_them(name: str) -> None:
    ground = hills()
    T = lift([0.0, 0.0, 0.1]) @ MOUNT
    shown = renderer(name, world(ground))
    depth, objects = shown.depth(T), shown.segmentation(T)
    points = points_behind(depth, T, CAMERA)[objects == GROUND]
    assert len(points) > 9000
    above = np.abs(points[:, 2] - ground.height(points[:, :2]))
    if name == "raster":
        assert above.max() < 1e-5
    else:  # snaps corners to 1/256 px, which tells on slopes seen edge-on
        assert np.quantile(above, 0.98) < 1e-5 and above.max() < 2e-3


@pytest.mark.parametrize("name", NAMES)
def test_objects_are_numbered_and_where_they_stand(name: str) -> None:
    """Whatever has an object's number lies on that object, to float precision."""
    solids, slabs = (
        one_box(3.0, 0.8, 0.4, (0.3, 0.2, 0.4)),
        one_box(2.0, 0.0, -0.3, (0.3, 0.5, 0.04)),
    )
    cylinders = post(2.6, -0.7, 0.15)
    shown = renderer(name, world(Ground.flat(8.0), solids, cylinders, slabs))
    T = lift([0.0, 0.0, 0.0]) @ MOUNT
    objects = shown.segmentation(T)
    points = points_behind(shown.depth(T), T, CAMERA)
    assert objects.dtype == np.int32
    assert set(np.unique(objects)) == {0, GROUND, FIRST, FIRST + 1, FIRST + 2}
    assert np.all(np.abs(on_surface_of_box(points[objects == FIRST], solids)) < 1e-5)
    assert np.all(np.abs(on_surface_of_box(points[objects == FIRST + 2], slabs)) < 1e-5)
    side = points[objects == FIRST + 1]
    side = side[side[:, 2] < 1.2 - 1e-5]
    radius = np.linalg.norm(side[:, :2] - [2.6, -0.7], axis=-1)
    assert np.abs(radius - 0.15).max() < 0.0009  # as many sides as 0.1 px needs


def on_surface_of_box(points: Array, box: Boxes) -> Array:
    """(n,) m by which points miss the surface."""
    T = lift([*box.centre[0, :2], box.yaw[0]])
    T[2, 3] = box.centre[0, 2]
    inside = box.half_extents[0] - np.abs((points - T[:3, 3]) @ T[:3, :3])
    return np.asarray(inside.min(axis=-1))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("heading", [-0.05, 0.11])
def test_corners_are_where_projection_puts_them(name: str, heading: float) -> None:
    """To 0.1 px of 320 x 240: the bounds of a box's picture, eight times as fine."""
    solids = one_box(2.5, 0.1, 0.5, (0.3, 0.4, 0.25))
    T = lift([0.0, 0.0, heading]) @ MOUNT
    seen = renderer(name, world(Ground.flat(8.0), solids), FINE).segmentation(T) == FIRST
    signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    pose = lift([*solids.centre[0, :2], solids.yaw[0]])
    corners = signs * solids.half_extents[0] @ pose[:3, :3].T + solids.centre[0]
    expected = pixels(corners, T, FINE)
    assert_bounds(seen, expected.min(axis=0), expected.max(axis=0))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("radius", [0.03, 0.12, 0.4])
def test_a_trunk_is_as_wide_as_its_silhouette(name: str, radius: float) -> None:
    """To 0.1 px of 320 x 240 at 2 m: lines of sight that touch the circle."""
    distance, finer = 2.0 + radius, 16
    strip = Pinhole(320 * finer, 4, finer * FX_320, FX_320, (320 * finer - 1) / 2, 1.5)
    trunk = renderer(name, world(Ground.flat(8.0), cylinders=post(distance, 0.0, radius)), strip)
    seen = trunk.segmentation(camera_mount(0.0, 0.0, 0.6))[0] == FIRST
    touching = FX_320 * np.tan(np.arcsin(radius / distance))
    assert abs(seen.sum() / finer / 2 - touching) < 0.1


@pytest.mark.parametrize("name", NAMES)
def test_a_ridge_is_where_projection_puts_its_nodes(name: str) -> None:
    """The skyline over one high node: its peak, to 0.1 px of 320 x 240."""
    heights = np.zeros((5, 5))
    heights[2, 2] = 0.8
    ground = Ground(heights, np.zeros((4, 4), dtype=np.int64), 0.5, np.array([2.0, -1.0]))
    T = camera_mount(0.0, 0.0, 0.5)
    sky = renderer(name, world(ground), FINE).segmentation(T) == 0
    peak = pixels(np.array([[3.0, 0.0, 0.8]]), T, FINE)[0]
    skyline = sky.sum(axis=0) - 0.5
    # The tip is narrower than a pixel; the two flanks, which are straight, meet in it.
    columns = np.flatnonzero(skyline < FINE.cy - 120)
    (a, b), (c, d) = (np.polyfit(part, skyline[part], 1) for part in np.array_split(columns, 2))
    x = (d - b) / (a - c)
    assert abs(x - peak[0]) < 0.1 * AS_OF_320
    assert abs(a * x + b - peak[1]) < 0.1 * AS_OF_320


def assert_bounds(seen: NDArray[np.bool_], low: Array, high: Array) -> None:
    """A bound, which lies between two pixels of the fine picture, is within 0.1 px of 320 x 240."""
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    first, last = np.array([columns[0], rows[0]]), np.array([columns[-1], rows[-1]])
    slack = 0.1 * AS_OF_320
    assert np.all(np.abs(first - 0.5 - low) < slack), (first, low)
    assert np.all(np.abs(last + 0.5 - high) < slack), (last, high)


@pytest.mark.parametrize("name", NAMES)
def test_the_undersides_of_what_hangs_are_seen(name: str) -> None:
    crown = Boxes(
        np.array([[3.0, 0.0, 2.5]]), np.array([[1.0, 1.0, 0.5]]), np.zeros(1), np.array([11])
    )
    T = camera_mount(0.0, 0.0, 0.4)
    shown = renderer(name, world(Ground.flat(8.0), crown))
    points = points_behind(shown.depth(T), T, CAMERA)[shown.segmentation(T) == FIRST]
    assert (np.abs(points[:, 2] - 2.0) < 1e-5).mean() > 0.3


@pytest.mark.parametrize("name", NAMES)
def test_from_above_all_ground_is_seen_without_a_crack(name: str) -> None:
    """Looking down from 25 m, at an angle, no pixel among hills or on patches shows the sky."""
    flat = Ground(np.zeros((25, 21)), hills().material, 0.4, np.array([-1.0, -4.5]))
    T = camera_mount(1.0, 0.5, 25.0, pitch=np.radians(83), yaw=0.3)
    for ground in (hills(), flat):
        objects = renderer(name, world(ground), FINE).segmentation(T)
        assert np.all(objects == GROUND)


@pytest.mark.parametrize("name", NAMES)
def test_images_and_depth_see_alike(name: str) -> None:
    """Where there is no ground, an image shows the sky's own grey."""
    T = lift([0.0, 0.0, 0.0]) @ MOUNT
    shown = renderer(name, world(Ground.flat(8.0), one_box(3.0, 0.0, 0.2, (0.3, 0.3, 0.8))))
    sky = ~np.isfinite(shown.depth(T))
    (image,) = shown.images([T])
    grey = np.abs(image[..., 0].astype(int) - 198) <= 1
    assert sky.mean() > 0.05 and grey[sky].mean() > 0.95


def test_camera_poses_are_of_the_optical_frame() -> None:
    p = inverse_transform(MOUNT) @ np.array([2.0, 0.0, 0.0, 1.0])
    assert p[2] > 1.5
