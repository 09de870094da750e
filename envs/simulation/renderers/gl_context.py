"""The one OpenGL context of a process: made at first use, never carried through a fork."""

import ctypes
import importlib.util
import os
from typing import Any

from grouser.envs.simulation.renderers.gl_threads import spread, threads

_CONTEXT: dict[str, Any] = {"owner": None, "context": None}

INSTALL = 'pip install "grouser[opengl]"'
LIBRARIES = {"libEGL.so.1": "libegl1", "libGL.so.1": "libgl1"}
"""System library and the Debian package that it is in."""
DRIVER_PACKAGE = "libgl1-mesa-dri"
_NO_MODERNGL = f"renderer='opengl' needs moderngl: {INSTALL} (renderer='raster' needs nothing)"


def require_opengl() -> None:
    """Raise for what is not installed, as `shared_context` would, but draw nothing: the process
    may be forked afterwards, and a driver that fails is found only at the first picture.

    Raises:
        ImportError: moderngl is not installed.
        RuntimeError: a system library is missing.
    """
    if importlib.util.find_spec("moderngl") is None:
        raise ImportError(_NO_MODERNGL)
    for library in LIBRARIES:
        try:
            ctypes.CDLL(library)
        except OSError as error:
            raise RuntimeError(_what_is_missing(library)) from error


def shared_context() -> Any:
    """The `moderngl.Context` of this process.

    Raises:
        ImportError: moderngl is not installed.
        RuntimeError: a system library is missing, or there is no driver; or this process was
            forked from one that had a context.
    """
    if _CONTEXT["owner"] is None:
        _CONTEXT["context"] = _new_context()
        _CONTEXT["owner"] = os.getpid()
    if _CONTEXT["owner"] != os.getpid():
        raise RuntimeError(
            "OpenGL had drawn in the process that this one was forked from, and its drivers do "
            "not survive a fork: start processes by spawn (gym.make_vec(..., context='spawn')), "
            "draw only after the fork, or use renderer='raster'"
        )
    return _CONTEXT["context"]


def _new_context() -> Any:
    try:
        import moderngl
    except ImportError as error:
        raise ImportError(_NO_MODERNGL) from error
    egl, gl = LIBRARIES
    off_screen: dict[str, Any] = {"backend": "egl", "libegl": egl, "libgl": gl}
    before = threads()
    try:
        context = moderngl.create_context(require=330, standalone=True, **off_screen)
    except Exception as error:  # moderngl raises just that
        raise RuntimeError(_what_is_missing(str(error))) from error
    if _is_software(context):
        spread(threads() - before)
    return context


def _what_is_missing(complaint: str) -> str:
    """What to install for what moderngl complains of."""
    for library, package in LIBRARIES.items():
        if library in complaint:
            return (
                f"renderer='opengl' needs the system library {library}, which is not installed: "
                f"on Debian or Ubuntu, apt-get install {package} {DRIVER_PACKAGE} "
                "(renderer='raster' needs nothing)"
            )
    return (
        f"renderer='opengl' found no OpenGL 3.3 driver ({complaint}): on Debian or Ubuntu, "
        f"apt-get install {' '.join(LIBRARIES.values())} {DRIVER_PACKAGE} for Mesa's software "
        "driver (renderer='raster' needs nothing)"
    )


def is_software() -> bool:
    """Whether the driver draws on the processor: Mesa's llvmpipe or softpipe."""
    return _is_software(shared_context())


def _is_software(context: Any) -> bool:
    name = context.info["GL_RENDERER"].lower()
    return any(driver in name for driver in ("llvmpipe", "softpipe", "swrast"))


def has_own_context() -> bool:
    """Whether this very process has made one."""
    return bool(_CONTEXT["owner"] == os.getpid())
