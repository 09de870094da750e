"""What is made of a world: faces that cover it, in its light, before its sky; and what is left out
when it cannot show."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.renderers.base import NEAR
from grouser.envs.simulation.renderers.coverage import SUBSAMPLES
from grouser.envs.simulation.renderers.cylinders import number_of_sides
from grouser.envs.simulation.renderers.faces import affine_shade
from grouser.envs.simulation.renderers.level_ground import level_ground_faces, rectangles
from grouser.envs.simulation.renderers.mesh import Mesh, world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.projection import View, meets_samples
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.renderers.relief import node_normals
from grouser.envs.simulation.renderers.textures import make_bank, texture_bank
from grouser.envs.simulation.world import Light
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.scenes import pixels
from tests.envs.simulation.renderers.test_geometry import hills, post, rays_of, world

CAMERA = Pinhole.with_field_of_view(160, 120, np.radians(66))
MOUNT = camera_mount(0.0, 0.0, 0.5, pitch=np.radians(12))
FLAT_WHITE = make_bank([[np.full((n, n, 1), 200.0) for n in (4, 2, 1)]] * 12)


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 9), st.integers(1, 4))
def test_rectangles_cover_every_cell_once_with_its_own_look(
    seed: int, rows: int, columns: int, kinds: int
) -> None:
    looks = np.random.default_rng(seed).integers(0, kinds, (rows, columns))
    count = np.zeros_like(looks)
    for r0, c0, r1, c1 in rectangles(looks):
        count[r0:r1, c0:c1] += 1
        assert len(np.unique(looks[r0:r1, c0:c1])) == 1
    assert np.all(count == 1)


def test_level_ground_of_one_look_is_one_face_however_many_its_cells() -> None:
    ground = Ground(np.zeros((41, 61)), np.zeros((40, 60), dtype=np.int64), 0.25, np.zeros(2))
    assert len(level_ground_faces(ground, Light())) == 1


@given(st.floats(0.01, 2.0))
def test_rounder_trunks_have_more_sides(radius: float) -> None:
    n = number_of_sides(radius)
    assert n % 2 == 0 and 6 <= n <= 120
    assert number_of_sides(2 * radius) >= n


@given(st.integers(0, 2**32 - 1))
def test_shade_is_affine_between_the_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    uv = np.array([[[0, 0], [1, 0], [1, 1], [0, 1]]]) + rng.normal(0, 0.1, (1, 1, 2))
    a, b, c = rng.uniform(0, 0.3, 3)
    lit = a + b * uv[..., 0] + c * uv[..., 1]
    np.testing.assert_allclose(affine_shade(uv, lit)[0], [a, b, c], atol=1e-6)


LEFT, TOP = st.floats(-20, 180), st.floats(-20, 140)
EXTENT = st.floats(0, 1.5)


@given(LEFT, TOP, EXTENT, EXTENT, st.sampled_from([1, 4]))
def test_what_is_left_out_covers_no_sample(
    left: float, top: float, width: float, height: float, samples: int
) -> None:
    """A box of the image is refused only if no row or no column of samples meets it."""
    view = View(np.eye(4), np.ones(4), np.array([160.0, 120.0]), NEAR, float(samples))
    x = (np.arange(160)[:, None] + SUBSAMPLES[samples][:, 0]).ravel()
    y = (np.arange(120)[:, None] + SUBSAMPLES[samples][:, 1]).ravel()
    across = bool(np.any((x >= left) & (x <= left + width)))
    down = bool(np.any((y >= top) & (y <= top + height)))
    kept = bool(meets_samples(left, left + width, top, top + height, view))
    assert kept or not (across and down)


@pytest.mark.parametrize("name", ["yard", "forest"])
def test_chunks_out_of_view_would_not_have_shown(name: str) -> None:
    """Faces that all stand in one chunk, which always reaches into view, give the same picture."""
    of = make_world(name, np.random.default_rng(0))
    mesh, T = world_mesh(of), lift(of.start)
    T[2, 3] = of.ground.height(of.start[:2])
    together = Mesh(
        replace(mesh.faces, chunk=np.zeros_like(mesh.faces.chunk)), mesh.relief, mesh.light
    )
    for turn in (0.0, 2.0, 4.0):
        pose = T @ lift([0, 0, turn]) @ MOUNT
        one, other = (Rasteriser(m, CAMERA, texture_bank(False)) for m in (mesh, together))
        assert np.array_equal(one.render(pose), other.render(pose))


def shown(light: Light, ground: Ground, T: Array) -> tuple[Array, NDArray[np.float32]]:
    """A picture (height, width) of what is painted one grey of 200, and its depth."""
    of = replace(world(ground, cylinders=post(2.5, 0.6, 0.3)), light=light)
    image = Rasteriser(world_mesh(of), CAMERA, FLAT_WHITE).render(T)[..., 0]
    return image.astype(np.float64), make_renderer("raster", of, CAMERA, color=False).depth(T)


def test_hills_are_shaded_by_the_normals_at_their_nodes() -> None:
    """Of a pixel near a node, the grey is that node's Lambert shade."""
    light, ground = Light(direction=np.array([0.6, 0.0, 0.8]), ambient=0.3, direct=0.7), hills()
    T = lift([0.0, 0.0, -0.4]) @ MOUNT
    image, depth = shown(light, ground, T)
    r, c = np.meshgrid(np.arange(8, 12), np.arange(4, 9), indexing="ij")
    xy = np.stack([ground.origin[0] + 0.4 * c, ground.origin[1] + 0.4 * r], axis=-1)
    nodes = np.concatenate([xy, ground.heights[r, c][..., None]], axis=-1).reshape(-1, 3)
    z = (nodes - T[:3, 3]) @ T[:3, 2]
    x, y = np.round(pixels(nodes, T, CAMERA)).astype(int).T
    seen = (z > 0) & (x >= 0) & (x < 160) & (y >= 0) & (y < 120)
    seen[seen] = np.abs(depth[y[seen], x[seen]] - z[seen]) < 0.05
    lit = 0.3 + 0.7 * np.clip(node_normals(ground)[r, c].reshape(-1, 3) @ light.direction, 0, 1)
    assert seen.sum() >= 6 and np.ptp(lit[seen]) > 0.03
    np.testing.assert_allclose(image[y[seen], x[seen]], 200 * lit[seen], atol=4)


def test_a_trunk_is_bright_on_the_side_of_the_light() -> None:
    light = Light(direction=np.array([-0.6, 0.8, 0.0]), ambient=0.2, direct=0.8)
    image, _ = shown(light, Ground.flat(8.0), camera_mount(0.0, 0.6, 0.6))
    row = image[60, 70:90]  # across the trunk, whose left side is lit
    trunk = row[(row > 30) & (row < 190)]
    assert len(np.unique(trunk)) > 5  # smooth, not in facets
    assert trunk[2] - trunk[-3] > 40


def test_the_sky_goes_from_horizon_to_zenith_by_elevation() -> None:
    light = Light(horizon=np.array([250.0, 200.0, 150.0]), zenith=np.array([50.0, 100.0, 200.0]))
    of = replace(world(Ground.flat(5.0)), light=light)
    T = lift([0.0, 0.0, 0.7]) @ camera_mount(0.0, 0.0, 0.5, pitch=np.radians(-20))
    (image,) = make_renderer("raster", of, CAMERA, color=True).images([T])
    rays = rays_of(CAMERA)[:40]
    rise = (rays @ T[2, :3] / np.linalg.norm(rays, axis=-1))[..., None]
    expected = light.horizon + rise * (light.zenith - light.horizon)
    assert np.abs(image[:40] - expected).max() < 1
