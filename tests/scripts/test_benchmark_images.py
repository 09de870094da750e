"""The images' quality, measured as the benchmark does: the issue's bounds hold."""

import numpy as np
import pytest

from grouser.scripts.benchmark_images import Frame, drive, image_quality, shimmer


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return drive("raster")


def test_visual_odometry_on_the_images_meets_its_bounds() -> None:
    figures = {name: value for name, (value, _) in image_quality().items()}
    assert figures["images.pnp_rotation_deg"] <= 0.04
    assert figures["images.pnp_translation_mm"] <= 1.2
    assert figures["images.stereo_matches"] >= 300
    assert figures["images.shimmer_percent"] <= 10


def test_a_picture_that_stands_still_does_not_shimmer(frames: list[Frame]) -> None:
    assert shimmer(frames[0], frames[0]) < 1e-3


def test_noise_and_wrong_motion_show_as_shimmer(frames: list[Frame]) -> None:
    first, second = frames[:2]
    rng = np.random.default_rng(0)
    noisy = np.clip(second.left + rng.normal(0, 30, second.left.shape), 0, 255).astype(np.uint8)
    worse = Frame(second.T_world_camera, noisy, second.right, second.depth)
    assert shimmer(first, worse) > 2 * shimmer(first, second)
    moved = Frame(second.T_world_camera, frames[3].left, second.right, second.depth)
    assert shimmer(first, moved) > 3 * shimmer(first, second)
