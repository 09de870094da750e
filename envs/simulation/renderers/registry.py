"""Renderers by name."""

from collections.abc import Callable

from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.gl_context import require_opengl
from grouser.envs.simulation.renderers.opengl import OpenGlRenderer
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.raster import RasterRenderer
from grouser.envs.simulation.world import World

_MAKERS: dict[str, Callable[..., Renderer]] = {"raster": RasterRenderer, "opengl": OpenGlRenderer}

RENDERERS = tuple(_MAKERS)
"""Names that `make_renderer` accepts."""


def make_renderer(name: str, world: World, camera: Pinhole, *, color: bool) -> Renderer:
    """A renderer of a world.

    Args:
        name: of RENDERERS.
        world: what there is to see.
        camera: its intrinsics.
        color: RGB images instead of grey ones.

    Raises:
        ValueError: no renderer has that name; the message lists those there are.
    """
    return _MAKERS[known_renderer(name)](world, camera, color=color)


def known_renderer(name: str) -> str:
    """The name, if a renderer has it.

    Raises:
        ValueError: none has; the message lists those there are.
    """
    if name not in RENDERERS:
        raise ValueError(f"no renderer is named {name!r}; known: {', '.join(RENDERERS)}")
    return name


def installed_renderer(name: str) -> str:
    """The name, if a renderer has it and what that needs is installed.

    Raises:
        ValueError: none has; the message lists those there are.
        ImportError, RuntimeError: a package, a system library is missing; it says what to install.
    """
    if known_renderer(name) == "opengl":
        require_opengl()
    return name
