"""Rendered pictures agree with the geometry that they show."""

import numpy as np
import pytest

from grouser.envs.simulation.renderers.boxes import box_faces
from grouser.envs.simulation.renderers.faces import Faces, join_faces
from grouser.envs.simulation.renderers.mesh import Mesh, world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.renderers.textures import texture_bank
from grouser.envs.simulation.world import Light
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.scenes import (
    SKY,
    bank_of,
    mesh_of,
    one_box,
    pixels,
    quadrilateral,
)

CAMERA = Pinhole.with_field_of_view(320, 240, np.radians(66))
MOUNT = camera_mount(0.20, 0.06, 0.40, pitch=np.radians(10))


BLACK = bank_of(np.zeros((4, 4), dtype=np.uint8))


def project(points: Array, T_world_camera: Array) -> Array:
    return pixels(points, T_world_camera, CAMERA)


def square(corners: Array) -> Mesh:
    return mesh_of(quadrilateral(corners))


def box(x: float, y: float, yaw: float, half: tuple[float, float, float]) -> Faces:
    return box_faces(one_box(x, y, yaw, half), Light(), first_object=2)


@pytest.mark.parametrize("heading", [0.0, 0.13, -0.2])
def test_edges_are_where_projection_puts_them(heading: float) -> None:
    """A black box before the sky: the cover of each row tells where its sides are."""
    T = lift([0, 0, heading]) @ MOUNT
    faces = box(3.0, 0.1, 0.3, (0.3, 0.4, 2.0))
    image = Rasteriser(mesh_of(faces), CAMERA, BLACK).render(T)[..., 0]
    half = np.array([0.3, 0.4])
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    c, s = np.cos(0.3), np.sin(0.3)
    feet = (signs * half) @ np.array([[c, s], [-s, c]]) + [3.0, 0.1]
    rows = np.arange(20, 100)
    expected = np.array(
        [vertical_edges_at_row(feet, T, float(row)) for row in rows]
    )  # left and right silhouette
    brightness = image[rows].astype(np.float64) / SKY
    middle = int(expected.mean())
    left = brightness[:, :middle].sum(axis=1) - 0.5
    right = CAMERA.width - 0.5 - brightness[:, middle:].sum(axis=1)
    # One row knows its edge to the spacing of the sub-samples; the mean over many, far better.
    assert np.abs(left - expected[:, 0]).max() < 0.3
    assert np.abs(right - expected[:, 1]).max() < 0.3
    assert abs(np.mean(left - expected[:, 0])) < 0.05
    assert abs(np.mean(right - expected[:, 1])) < 0.05


def vertical_edges_at_row(feet: Array, T: Array, row: float) -> tuple[float, float]:
    """Outermost pixels at which the vertical lines above `feet` cross an image row."""
    bottom = project(np.column_stack([feet, np.zeros(4)]), T)
    top = project(np.column_stack([feet, np.full(4, 4.0)]), T)
    t = (row - bottom[:, 1]) / (top[:, 1] - bottom[:, 1])
    x = bottom[:, 0] + t * (top[:, 0] - bottom[:, 0])
    return float(x.min()), float(x.max())


@pytest.mark.parametrize("pose", [(0, 0, 0), (0.3, -0.2, 0.2), (-0.5, 0.3, -0.3)])
def test_texture_is_where_projection_puts_it(pose: tuple[float, float, float]) -> None:
    """A soft white spot on a black square: the centroid of its picture, to 0.1 px."""
    n = 256
    grid = (np.arange(n) + 0.5) / n
    at_u, at_v, sigma = 0.60, 0.35, 0.02
    spot = np.exp(-((grid[None] - at_u) ** 2 + (grid[:, None] - at_v) ** 2) / (2 * sigma**2))
    bank = bank_of(np.round(255 * spot).astype(np.uint8))
    corners = np.array([[1.5, 0.6, 0.0], [1.5, -0.6, 0.0], [3.0, -0.6, 0.8], [3.0, 0.6, 0.8]])
    T = lift(pose) @ MOUNT
    image = Rasteriser(square(corners), CAMERA, bank).render(T)[..., 0].astype(np.float64)
    image[image == SKY] = 0
    u, v = at_u, at_v
    point = corners[0] + u * (corners[1] - corners[0]) + v * (corners[3] - corners[0])
    expected = project(point[None], T)[0]
    window = (
        np.hypot(np.arange(320)[None] - expected[0], np.arange(240)[:, None] - expected[1]) < 25
    )
    weight = np.where(window, image, 0)
    y, x = np.mgrid[0:240, 0:320]
    centroid = np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()
    # The picture of a spot's middle is not the middle of its picture: the latter from its points,
    # each of which covers an area of the picture that goes with depth^-3 (a homography's Jacobian).
    scatter = np.random.default_rng(0).normal(0, sigma, (20000, 2)) + [u, v]
    points = corners[0] + scatter[:, :1] * (corners[1] - corners[0])
    points = points + scatter[:, 1:] * (corners[3] - corners[0])
    area = ((points - T[:3, 3]) @ T[:3, 2]) ** -3.0
    assert np.abs(centroid - area @ project(points, T) / area.sum()).max() < 0.1


def test_what_is_nearer_hides_what_is_behind() -> None:
    near, far = box(2.0, 0.0, 0.0, (0.2, 0.2, 0.3)), box(4.0, 0.0, 0.0, (0.2, 2.0, 1.0))
    white = bank_of(np.full((4, 4), 255, dtype=np.uint8))
    T = lift([0, 0, 0]) @ MOUNT
    one = Rasteriser(mesh_of(join_faces(near, far)), CAMERA, white, samples=1).render(T)
    other = Rasteriser(mesh_of(join_faces(far, near)), CAMERA, white, samples=1).render(T)
    assert np.array_equal(one, other)
    only_near = Rasteriser(mesh_of(near), CAMERA, white, samples=1).render(T)
    shown = only_near != SKY
    assert shown.sum() > 500 and np.array_equal(one[shown], only_near[shown])
    assert np.any(one[~shown] != only_near[~shown])  # the far one shows beside it


def test_a_face_that_passes_the_camera_is_cut_and_not_mirrored() -> None:
    ground = np.array([[-50.0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]])
    image = Rasteriser(square(ground), CAMERA, BLACK).render(lift([0, 0, 0.4]) @ MOUNT)[..., 0]
    horizon = CAMERA.cy - CAMERA.fy * np.tan(np.radians(10))
    assert np.all(image[: int(horizon) - 1] == SKY)
    assert np.all(image[int(horizon) + 3 :] == 0)


def test_sub_samples_soften_edges() -> None:
    faces, T = box(3.0, 0.1, 0.3, (0.3, 0.4, 2.0)), lift([0, 0, 0]) @ MOUNT
    assert set(np.unique(Rasteriser(mesh_of(faces), CAMERA, BLACK, samples=1).render(T))) == {
        0,
        SKY,
    }
    assert set(np.unique(Rasteriser(mesh_of(faces), CAMERA, BLACK, samples=4).render(T))) == {
        0, 50, 99, 149, SKY
    }  # fmt: skip


def test_mip_maps_keep_far_texture_still() -> None:
    """A fine checkerboard far away is grey, not a moire pattern."""
    checks = (np.indices((256, 256)).sum(axis=0) % 2 * 255).astype(np.uint8)
    corners = np.array([[16.0, 2, 0], [16, -2, 0], [16, -2, 3], [16, 2, 3]])
    image = Rasteriser(square(corners), CAMERA, bank_of(checks)).render(lift([0, 0, 0]) @ MOUNT)
    wall = image[50:75, 140:180, 0].astype(np.float64)
    assert wall.std() < 2.0
    assert wall.mean() == pytest.approx(127.5, abs=2)


def test_grey_is_the_luma_of_the_colour_picture() -> None:
    world = make_world("yard", np.random.default_rng(1))
    T = lift(world.start) @ MOUNT
    grey = Rasteriser(world_mesh(world), CAMERA, texture_bank(False)).render(T)
    rgb = Rasteriser(world_mesh(world), CAMERA, texture_bank(True)).render(T)
    assert (grey.shape, rgb.shape) == ((240, 320, 1), (240, 320, 3))
    ground = np.s_[150:, :]
    luma = rgb[ground] @ np.array([0.299, 0.587, 0.114])
    assert np.abs(luma - grey[ground][..., 0]).max() < 3


def test_a_picture_is_new_memory_and_the_same_bits() -> None:
    world = make_world("yard", np.random.default_rng(1))
    renderer = Rasteriser(world_mesh(world), CAMERA, texture_bank(False))
    T = lift(world.start) @ MOUNT
    first, second = renderer.render(T), renderer.render(T)
    assert np.array_equal(first, second) and not np.may_share_memory(first, second)
    assert first.std() > 20
