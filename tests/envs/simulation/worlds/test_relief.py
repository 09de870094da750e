"""Hills: as steep as asked for, level where asked for; fields of the stated size and share."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser.envs.simulation.materials import MATERIAL_NAMES
from grouser.envs.simulation.worlds.noise import patches, smooth_noise
from grouser.envs.simulation.worlds.relief import (
    Waves,
    cell_positions,
    cell_slopes,
    level_ground,
    with_hills,
    with_material,
)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    steepest=st.floats(0.02, 0.35),
    x=st.floats(-6, 6),
    y=st.floats(-4, 4),
)
def test_the_steepest_triangle_has_the_slope_asked_for_and_the_start_none(
    seed: int, steepest: float, x: float, y: float
) -> None:
    rng = np.random.default_rng(seed)
    ground = with_hills(
        rng,
        level_ground((8.0, 6.0), "grass"),
        steepest=steepest,
        waves=[Waves(3.0, 8.0), Waves(1.0, 2.0, 0.3)],
        level_at=(x, y),
        level_radius=1.0,
    )
    assert cell_slopes(ground.heights, ground.cell).max() == pytest.approx(
        math.tan(steepest), abs=1e-3
    )
    angle = np.linspace(0, 2 * np.pi, 30)
    circle = np.column_stack([x + np.cos(angle), y + np.sin(angle)])
    np.testing.assert_allclose(ground.height(circle), 0, atol=1e-12)
    assert np.ptp(ground.heights) > 0.1 * steepest


def test_slopes_of_cells_are_those_of_the_ground_that_tracks_and_cameras_take() -> None:
    ground = level_ground((3.0, 2.0), "grass")
    hills = with_hills(
        np.random.default_rng(1),
        ground,
        steepest=0.3,
        waves=[Waves(1.0, 4.0)],
        level_at=(0, 0),
        level_radius=0.5,
    )
    middle, quarter = cell_positions(hills), hills.cell / 4
    normals = [hills.normal(middle + d) for d in ([quarter, -quarter], [-quarter, quarter])]
    slopes = [np.hypot(n[..., 0], n[..., 1]) / n[..., 2] for n in normals]
    np.testing.assert_allclose(cell_slopes(hills.heights, hills.cell), np.maximum(*slopes))


@pytest.mark.parametrize("shape", [(64, 64), (50, 91)])
def test_noise_lies_between_its_wavelengths(shape: tuple[int, int]) -> None:
    """It crosses zero about as often as a band of such waves does (Rice 1944)."""
    noise = smooth_noise(np.random.default_rng(0), (400, 300), 0.1, shortest=2.0, longest=4.0)
    assert noise.mean() == pytest.approx(0, abs=1e-9) and noise.std() == pytest.approx(1)
    crossings = np.mean(np.diff(np.sign(noise), axis=1) != 0) / 0.1  # a metre
    assert 2 / 4.0 / math.sqrt(2) < crossings < 2 / 2.0
    assert smooth_noise(
        np.random.default_rng(0), shape, 0.1, shortest=1.0, longest=3.0
    ).shape == shape  # fmt: skip


@given(share=st.floats(0, 0.9), seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_patches_cover_their_share(share: float, seed: int) -> None:
    covered = patches(np.random.default_rng(seed), (60, 80), 0.25, share=share, size=1.5)
    assert covered.mean() == pytest.approx(share, abs=0.002)


def test_material_is_put_where_it_is_asked_for() -> None:
    ground = level_ground((3.0, 2.0), "grass")
    path = np.abs(cell_positions(ground)[..., 1]) < 0.5
    paved = with_material(ground, path, "cement")
    names = [MATERIAL_NAMES[k] for k in paved.material_at([[2.0, 0.3], [2.0, 0.6], [-3.2, -0.1]])]
    assert names == ["cement", "grass", "cement"]
