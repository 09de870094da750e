"""What a pixel takes of a texture: the right scale, the right place, the right light.

A texture whose levels are 0, 50, 100 ... tells in the picture which scale a pixel took, and one
that is a ramp, which place.
"""

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.faces import Faces
from grouser.envs.simulation.renderers.mesh import world_mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.renderers.textures import TextureBank, make_bank
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.scenes import SKY, mesh_of, quadrilateral

CAMERA = Pinhole(160, 120, 100.0, 100.0, 79.5, 59.5)
SIDE = 64  # texels
A_LEVEL = 50.0  # grey levels


def bank(*levels: NDArray[np.float64]) -> TextureBank:
    return make_bank([[level[..., None] for level in levels]])


def sides() -> list[int]:
    return [SIDE >> k for k in range(SIDE.bit_length())]


TELLS_SCALE = bank(*(np.full((n, n), min(A_LEVEL * k, 255)) for k, n in enumerate(sides())))
TELLS_PLACE = bank(  # row v is grey level 4 v + 2, whatever the scale
    *(np.repeat((np.arange(n) + 0.5)[:, None] * 256 / n, n, axis=1) for n in sides())
)
WHITE = bank(*(np.full((n, n), 255.0) for n in sides()))


def face(corners: list[list[float]], tiles: float, shade: float = 1.0) -> Faces:
    return quadrilateral(np.array(corners), tiles, shade)


def wall(distance: float, tiles: float, shade: float = 1.0) -> Faces:
    """A square of 4 m across the view."""
    d = distance
    return face([[d, 2, -2], [d, -2, -2], [d, -2, 2], [d, 2, 2]], tiles, shade)


def floor(tiles: float) -> Faces:
    """A square of 32 m below the camera, v growing with the distance."""
    return face([[0, 16, 0], [0, -16, 0], [32, -16, 0], [32, 16, 0]], tiles)


def picture(faces: Faces, textures: TextureBank, height: float, **options: int) -> Array:
    image = Rasteriser(mesh_of(faces), CAMERA, textures, **options).render(
        lift([0, 0, 0]) @ mount(height)
    )
    return image[..., 0].astype(np.float64)


def mount(height: float) -> Array:
    return camera_mount(0.0, 0.0, height)


@pytest.mark.parametrize("texels_a_pixel", [0.5, 1.0, 1.25, 1.5, 1.9, 2.0, 3.0, 5.0])
def test_a_pixel_blends_the_two_scales_next_to_its_size(texels_a_pixel: float) -> None:
    distance = 3.0
    texels_a_metre = texels_a_pixel * CAMERA.fx / distance
    image = picture(wall(distance, 4 * texels_a_metre / SIDE), TELLS_SCALE, 0.0)
    level = max(0, int(np.floor(np.log2(texels_a_pixel))))
    expected = A_LEVEL * (level + max(texels_a_pixel / 2**level - 1, 0))
    assert np.abs(image[30:90, 50:110] - expected).max() <= 1


def test_twice_the_samples_along_the_longer_axis_are_one_scale_finer() -> None:
    """Far on a floor a pixel is many times as long as it is wide."""
    row = int(CAMERA.cy + 8.5)
    once = picture(floor(4), TELLS_SCALE, 1.0, anisotropy=1)[row, 60:100]
    twice = picture(floor(4), TELLS_SCALE, 1.0, anisotropy=2)[row, 60:100]
    assert 2 * A_LEVEL < once.mean() < 5 * A_LEVEL
    np.testing.assert_allclose(once - twice, A_LEVEL, atol=1)


@pytest.mark.parametrize("anisotropy", [1, 2, 4])
def test_the_samples_lie_evenly_about_the_pixel(anisotropy: int) -> None:
    """On a ramp, any number of them gives the value in the middle."""
    height = 1.0
    image = picture(floor(1), TELLS_PLACE, height, anisotropy=anisotropy)
    rows = np.arange(66, 80)
    distance = CAMERA.fy * height / (rows - CAMERA.cy)
    expected = distance / 32 * 256
    # A pixel's middle is not the mean of what it covers: a step as large as the pixel is curved.
    np.testing.assert_allclose(image[rows, 80], expected, atol=1.0)


def test_light_dims_a_face_and_its_edges() -> None:
    image = picture(wall(3.3, 1.0, shade=0.5), WHITE, 0.3)
    shares = np.arange(5) / 4
    sky = SKY
    expected = {int(share * 127.5 + (1 - share) * sky + 0.5) for share in shares}
    assert {128, int(sky)} < set(np.unique(image).astype(int)) <= expected


def test_faces_that_look_elsewhere_are_lit_otherwise() -> None:
    shade = world_mesh(make_world("yard", np.random.default_rng(0))).faces.shade[:, 0]
    assert shade[0] == shade.max()  # the ground lies in the light
    assert 0.5 < shade.min() < 0.6 < 0.9 < shade.max() <= 1
