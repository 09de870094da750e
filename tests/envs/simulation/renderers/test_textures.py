"""Textures tile, are rich in corners, and their mip-maps keep the mean."""

from hashlib import sha256

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers import grains
from grouser.envs.simulation.renderers.textures import (
    TextureBank,
    texture_bank,
    texture_colours,
)

TEXTURE_INDICES = range(len(TEXTURES))
POOR = ("mud", "ice")


def level(bank: TextureBank, texture: int, k: int) -> NDArray[np.uint8]:
    return bank.level(texture, k)


@pytest.mark.parametrize("color", [False, True])
def test_every_texture_is_a_power_of_two_with_all_levels(color: bool) -> None:
    bank = texture_bank(color)
    assert len(bank.sizes) == len(TEXTURES)
    assert np.all(bank.sizes & (bank.sizes - 1) == 0)
    total = sum(level(bank, t, k).size for t in TEXTURE_INDICES for k in range(size_log(bank, t)))
    assert total == bank.texels.size
    assert bank.channels == (3 if color else 1)


def size_log(bank: TextureBank, texture: int) -> int:
    return int(bank.sizes[texture]).bit_length()


@pytest.mark.parametrize("texture", TEXTURE_INDICES)
def test_mip_maps_keep_the_mean(texture: int) -> None:
    bank = texture_bank(False)
    finest = level(bank, texture, 0)
    coarsest = level(bank, texture, size_log(bank, texture) - 1)
    assert coarsest.shape == (1, 1, 1)
    assert float(coarsest[0, 0, 0]) == pytest.approx(finest.mean(), abs=1.0)


@pytest.mark.parametrize("texture", TEXTURE_INDICES)
def test_a_tile_continues_in_the_next(texture: int) -> None:
    image = level(texture_bank(False), texture, 0)[..., 0].astype(np.float64)
    for axis in (0, 1):
        steps = np.abs(np.diff(image, axis=axis)).mean()
        seam = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        # At a mortar joint the seam is an edge, as all joints are.
        joints = np.abs(np.diff(image, axis=axis)).mean(axis=1 - axis).max()
        assert seam <= max(2 * steps, 1.2 * joints)


def corners_a_texel(name: str) -> float:
    image = np.ascontiguousarray(level(texture_bank(False), TEXTURES.index(name), 1)[..., 0])
    return len(cv2.FastFeatureDetector.create(20).detect(image)) / image.size


@pytest.mark.parametrize("name", [name for name in TEXTURES if name not in POOR])
def test_textures_are_rich_in_corners(name: str) -> None:
    assert corners_a_texel(name) > 5e-3


@pytest.mark.parametrize("name", POOR)
def test_mud_and_ice_are_as_poor_as_the_real_ones(name: str) -> None:
    assert corners_a_texel(name) < 1e-3


def test_grey_is_the_luma_of_the_colours() -> None:
    grey = level(texture_bank(False), 1, 0)[..., 0].astype(np.float64)
    rgb = level(texture_bank(True), 1, 0).astype(np.float64)
    assert np.abs(rgb @ [0.299, 0.587, 0.114] - grey).max() < 1.6  # two roundings


def test_the_bank_is_built_once() -> None:
    assert texture_bank(False) is texture_bank(False)


def test_the_colour_of_a_texture_is_the_mean_of_its_texels() -> None:
    bank = texture_bank(True)
    for texture, colour in enumerate(texture_colours()):
        mean = bank.level(texture, 0).mean(axis=(0, 1))
        np.testing.assert_allclose(colour, mean, atol=1.0)


DRAWN = {"grass": "871afa653f6d9208", "foliage": "5000a53cb43f1732"}


@pytest.mark.parametrize("name", DRAWN)
def test_what_is_drawn_is_the_same_with_every_opencv(name: str) -> None:
    """A line of OpenCV 4.9 is not one of 5.0: these hashes hold with both, and NumPy 1.26."""
    texels = texture_bank(False).level(TEXTURES.index(name), 0)
    assert sha256(texels.tobytes()).hexdigest()[:16] == DRAWN[name]


def test_lines_and_triangles_wrap_around_the_tile() -> None:
    tile = np.zeros((16, 16))
    grains._draw_lines(tile, np.array([[[-3, 5], [3, 5]]]), np.array([9.0]))
    assert sorted(set(np.nonzero(tile)[1])) == [0, 1, 2, 3, 13, 14, 15]
    assert set(np.nonzero(tile)[0]) == {4, 5, 6}
    tile[:] = 0
    grains._draw_triangles(tile, np.array([[[14, 14], [18, 14], [14, 18]]]), np.array([9.0]))
    assert tile[14, 14] == tile[2, 14] == tile[14, 2] == tile[0, 0] == 9
    assert tile[1, 1] == 0 and (tile > 0).sum() == 15
