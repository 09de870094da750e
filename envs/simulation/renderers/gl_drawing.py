"""One world and one camera in OpenGL: buffers, programs and frame buffers, and how they draw."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers.base import NEAR, Image
from grouser.envs.simulation.renderers.gl_context import has_own_context, shared_context
from grouser.envs.simulation.renderers.gl_shaders import (
    MEASURE_FRAGMENT,
    QUICK_SCENE_FRAGMENT,
    SCENE_FRAGMENT,
    SCENE_VERTEX,
    SKY_FRAGMENT,
    SKY_VERTEX,
)
from grouser.envs.simulation.renderers.gl_textures import texture_array
from grouser.envs.simulation.renderers.mesh import Mesh
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.sky import sky_colours
from grouser.envs.simulation.renderers.textures import texture_bank
from grouser.envs.simulation.renderers.triangles import mesh_triangles
from grouser.geometry import Array, inverse_transform

VIEWS = 2
"""How many are drawn at once, side by side."""

_FAR = 500.0  # m
_SAMPLES = 4
_ANISOTROPY = 2.0  # as of the rasteriser
_CLIP_DISTANCE0 = 0x3000
_TRIANGLE = ("3f 2f 1f 1f 1f", "position", "uv", "shade", "texture_index", "object")


class GlDrawing:
    """Draws one mesh through one camera; not for two threads at a time.

    Args:
        quick: without sub-samples and with plain mip-maps, in a third of the time where there is
            no graphics hardware.
    """

    def __init__(self, mesh: Mesh, camera: Pinhole, *, color: bool, quick: bool) -> None:
        context = shared_context()
        self._camera, self._channels = camera, 3 if color else 1
        self._textures = texture_array(color)
        self._triangles = context.buffer(mesh_triangles(mesh).tobytes())
        buffers = [(self._triangles, *_TRIANGLE)]
        scene, sky, measure = _programs(self._channels, quick)
        self._scene, self._measure = (
            context.vertex_array(program, buffers, skip_errors=True) for program in (scene, measure)
        )
        self._sky = context.vertex_array(sky, [])
        colours = sky_colours(mesh.light, self._channels)
        self._sky_colours = [_vector(np.broadcast_to(colour / 255, 3)) for colour in colours]
        self._flat = self._target(self._channels, "f1", samples=0)
        self._drawn = self._flat if quick else self._target(self._channels, "f1", _SAMPLES)
        self._measured = self._target(2, "f4", samples=0)

    def images(self, poses: Sequence[Array]) -> list[Image]:
        """At most VIEWS images (height, width, channels)."""
        context = self._begin(self._drawn)
        self._textures.use(0)
        context.enable(moderngl.CULL_FACE | moderngl.DEPTH_TEST)
        self._render(self._scene, poses)
        # The sky comes last, at the far end of the depth buffer: only where nothing else shows.
        context.disable(moderngl.CULL_FACE)
        context.depth_func = "<="
        self._render_sky(poses)
        context.depth_func = "<"
        if self._drawn is not self._flat:
            context.copy_framebuffer(self._flat, self._drawn)
        return self._read(self._flat, self._channels, np.uint8, len(poses))

    def measure(self, T_world_camera: Array) -> NDArray[np.float32]:
        """(height, width, 2) depth [m] and object at the pixels' centres; zeros for sky."""
        context = self._begin(self._measured)
        context.enable(moderngl.CULL_FACE | moderngl.DEPTH_TEST)
        self._render(self._measure, [T_world_camera])
        (measured,) = self._read(self._measured, 2, np.float32, 1)
        return measured

    def release(self) -> None:
        """Free everything that is not shared; nothing in a forked process, to whom nothing is."""
        if not has_own_context():
            return
        arrays = (self._scene, self._measure, self._sky, self._triangles)
        targets = {self._drawn, self._flat, self._measured}
        attachments = [a for t in targets for a in (*t.color_attachments, t.depth_attachment)]
        for held in (*arrays, *targets, *attachments):
            held.release()

    def _begin(self, target: Any) -> Any:
        context = shared_context()  # refuses in a forked process
        target.use()
        target.clear()
        context.enable_only(moderngl.NOTHING)
        context.enable_direct(_CLIP_DISTANCE0)
        context.front_face = "cw"  # rows run down
        return context

    def _render_sky(self, poses: Sequence[Array]) -> None:
        c, program = self._camera, self._sky.program
        program["horizon"].write(self._sky_colours[0])
        program["zenith"].write(self._sky_colours[1])
        program["intrinsics"].write(_vector([c.fx, c.fy, c.cx, c.cy]))
        program["image_size"].write(_vector([c.width, c.height]))
        program["up"].write(_vector(_filled_up([T[2, :3] for T in poses])))
        self._sky.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(poses))

    def _render(self, array: Any, poses: Sequence[Array]) -> None:
        columns = [_clip_from_world(self._camera, T).T for T in poses]  # OpenGL's order
        array.program["clip_from_world"].write(_vector(_filled_up(columns)))
        array.render(moderngl.TRIANGLES, instances=len(poses))

    def _target(self, channels: int, dtype: str, samples: int) -> Any:
        context, size = shared_context(), (VIEWS * self._camera.width, self._camera.height)
        return context.framebuffer(
            [context.renderbuffer(size, channels, samples=samples, dtype=dtype)],
            context.depth_renderbuffer(size, samples=samples),
        )

    def _read(self, target: Any, channels: int, dtype: Any, n: int) -> list[NDArray[Any]]:
        height, width = self._camera.height, self._camera.width
        pixels = np.empty((height, VIEWS * width, channels), dtype=dtype)
        kind = "f1" if dtype is np.uint8 else "f4"
        target.read_into(pixels, components=channels, alignment=1, dtype=kind)
        return [pixels[:, k * width : (k + 1) * width].copy() for k in range(n)]


@cache
def _programs(channels: int, quick: bool) -> tuple[Any, Any, Any]:
    """For scenes, skies and measurements."""
    context, bank = shared_context(), texture_bank(channels == 3)
    fragment = QUICK_SCENE_FRAGMENT if quick else SCENE_FRAGMENT
    scene = context.program(SCENE_VERTEX, fragment.replace("N_TEXTURES", str(len(TEXTURES))))
    scene["sizes"].write(_vector(bank.sizes))
    scene["array_size"].value = float(bank.sizes.max())
    if not quick:
        scene["anisotropy"].value = _ANISOTROPY
    sky = context.program(SKY_VERTEX, SKY_FRAGMENT)
    return scene, sky, context.program(SCENE_VERTEX, MEASURE_FRAGMENT)


def _clip_from_world(camera: Pinhole, T_world_camera: Array) -> Array:
    """(4, 4) into OpenGL's cube, with rows of the image upwards and pixel centres at integers."""
    c = camera
    P = np.zeros((4, 4))
    P[0, 0], P[0, 2] = 2 * c.fx / c.width, (2 * c.cx + 1) / c.width - 1
    P[1, 1], P[1, 2] = 2 * c.fy / c.height, (2 * c.cy + 1) / c.height - 1
    P[2, 2], P[2, 3] = (_FAR + NEAR) / (_FAR - NEAR), -2 * _FAR * NEAR / (_FAR - NEAR)
    P[3, 2] = 1
    return np.asarray(P @ inverse_transform(T_world_camera))


def _filled_up(values: Sequence[Array]) -> Array:
    """One for each view: the last again where there are fewer."""
    return np.stack([*values, *[values[-1]] * (VIEWS - len(values))])


def _vector(values: Any) -> bytes:
    return np.ascontiguousarray(values, dtype=np.float32).tobytes()
