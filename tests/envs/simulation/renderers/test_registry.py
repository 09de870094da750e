"""Renderers by name; what both do alike."""

import numpy as np
import pytest

from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import RENDERERS, make_renderer
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.opengl_here import needs_opengl

CAMERA = Pinhole.with_field_of_view(96, 64, np.radians(66))
MOUNT = camera_mount(0.20, 0.06, 0.40, pitch=np.radians(10))
WORLD = make_world("yard", np.random.default_rng(1))
NAMES = [pytest.param(n, marks=[needs_opengl] if n == "opengl" else []) for n in RENDERERS]


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(ValueError, match="no renderer is named 'rsater'; known: raster, opengl"):
        make_renderer("rsater", WORLD, CAMERA, color=False)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("color", [False, True])
def test_an_image_does_not_depend_on_what_else_is_drawn(name: str, color: bool) -> None:
    poses = [lift([*WORLD.start[:2], heading]) @ MOUNT for heading in (0.0, 0.5, 2.0)]
    renderer = make_renderer(name, WORLD, CAMERA, color=color)
    together = renderer.images(poses)
    alone = [renderer.images([pose])[0] for pose in poses]
    assert [image.shape for image in together] == [(64, 96, 3 if color else 1)] * 3
    for one, other in zip(together, alone, strict=True):
        if name == "raster":
            assert np.array_equal(one, other)
        else:  # in the other half of its buffer, OpenGL rounds corners otherwise by 1/256 px
            assert np.abs(one.astype(int) - other).mean() < 0.2
    assert not np.array_equal(together[0], together[1])
    assert not any(np.may_share_memory(a, together[0]) for a in [*together[1:], *alone])
    assert renderer.images([]) == []
    renderer.close()
    renderer.close()


@pytest.mark.parametrize("name", NAMES)
def test_two_renderers_of_a_process_do_not_disturb_each_other(name: str) -> None:
    T = lift(WORLD.start) @ MOUNT
    other_world = make_world("yard", np.random.default_rng(2))
    first = make_renderer(name, WORLD, CAMERA, color=False)
    before = first.images([T])[0]
    other = make_renderer(name, other_world, CAMERA, color=True)
    other.images([lift(other_world.start) @ MOUNT])
    assert np.array_equal(first.images([T])[0], before)
    other.close()
    assert np.array_equal(first.images([T])[0], before)
    first.close()


@pytest.mark.parametrize("name", NAMES)
def test_grey_is_the_luma_of_the_colours(name: str) -> None:
    T = lift(WORLD.start) @ MOUNT
    grey, rgb = (make_renderer(name, WORLD, CAMERA, color=c).images([T])[0] for c in (False, True))
    luma = rgb @ np.array([0.299, 0.587, 0.114])
    difference = np.abs(luma - grey[..., 0])
    assert difference.mean() < 1 and difference.max() < 6
