"""Bands as wide as the map says, and a picture that shows what there is, or nothing."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from grouser.estimators.line_slam.lines import normals, places_along
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.map_plot import Surroundings, bands, draw_map
from grouser.geometry import Array
from tests.estimators.line_slam.maps import random_map

WAY = np.column_stack([np.linspace(0, 20, 50), np.zeros(50), np.zeros(50)])


def test_a_band_is_so_many_sigmas_wide_all_along_its_line() -> None:
    line_map = random_map(5)
    outlines = bands(line_map, sigmas=2.0)
    lines = line_map.lines[:, None]
    across = (normals(lines[..., 1]) * outlines).sum(axis=-1) - lines[..., 0]
    sigma = line_map.offset_sigmas(places_along(lines, outlines))
    k = outlines.shape[1] // 2
    np.testing.assert_allclose(across[:, :k], 2 * sigma[:, :k])
    np.testing.assert_allclose(across[:, k:], -2 * sigma[:, k:])
    np.testing.assert_allclose(places_along(lines, outlines)[:, [0, k - 1]], line_map.extents)


def picture(line_map: LineMap, over: Surroundings, path: Path) -> Array:
    pytest.importorskip(
        "matplotlib", reason="matplotlib is not installed: pip install -e '.[plot]'"
    )
    draw_map(line_map, over, title="a map").savefig(path, dpi=50)
    image = cv2.imread(str(path))
    assert image is not None
    return np.asarray(image, dtype=np.float64)


def share(image: Array, blue: int, green: int, red: int) -> float:
    """Of the pixels that are about of this colour."""
    return float((np.abs(image - [blue, green, red]).max(axis=2) < 40).mean())


def test_wider_bands_fill_more_of_the_picture(tmp_path: Path) -> None:
    orange = (115, 215, 245)
    shares = [
        share(picture(random_map(4, sigma=sigma), Surroundings(WAY), tmp_path / "a.png"), *orange)
        for sigma in (0.02, 0.5)
    ]
    assert shares[0] < 0.02 < shares[1]


def test_what_truly_stands_there_and_what_was_hit_is_drawn(tmp_path: Path) -> None:
    line_map = random_map(4)
    segments = line_map.ends.reshape(-1, 4) + 1.0
    bare = picture(line_map, Surroundings(WAY), tmp_path / "bare.png")
    over = Surroundings(WAY, WAY + [0, 1, 0], segments, segments[:, :2])
    full = picture(line_map, over, tmp_path / "full.png")
    assert share(full, 190, 190, 190) > share(bare, 190, 190, 190) + 0.005


def test_an_empty_map_has_a_picture_too(tmp_path: Path) -> None:
    assert share(picture(random_map(0), Surroundings(WAY), tmp_path / "a.png"), 178, 114, 0) > 0
