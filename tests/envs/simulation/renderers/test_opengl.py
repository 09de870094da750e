"""OpenGL shows what the rasteriser shows, says what it misses, and stands processes."""

import os
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import numpy as np
import pytest

from grouser.envs.simulation.renderers import gl_context, opengl
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, lift
from grouser.rig import camera_mount
from tests.envs.simulation.renderers.opengl_here import needs_opengl
from tests.envs.simulation.renderers.scenes import one_box
from tests.envs.simulation.renderers.test_geometry import hills, post, world

CAMERA = Pinhole.with_field_of_view(320, 240, np.radians(66))
MOUNT = camera_mount(0.20, 0.06, 0.40, pitch=np.radians(10))


def mixed_world() -> World:
    """Boxes, a cylinder and a slab on hills of three materials."""
    solids, slabs = one_box(4.0, 1.0, 0.4, (0.3, 0.4, 0.6)), one_box(2.5, 0.0, 0.2, (0.3, 0.4, 0.2))
    return world(hills(), solids, post(3.0, -0.8, 0.2), slabs)


def views(of: World) -> list[Array]:
    T = lift(of.start)
    T[2, 3] = of.ground.height(of.start[:2])
    return [T @ lift([0, 0, turn]) @ MOUNT for turn in (0.0, 0.4)]


AGREEMENT = {"smooth": (1.5, 5e-3, 5e-4), "quick": (3.0, 0.08, 0.01)}
"""Mean absolute difference, grey levels, and shares of pixels off by more than 8 and by more than
32. On hardware only edges differ, whose sub-samples do; a software driver is given less to do:
neither sub-samples nor a second tap."""


@needs_opengl
@pytest.mark.parametrize("how", AGREEMENT)
@pytest.mark.parametrize("color", [False, True])
@pytest.mark.parametrize("name", ["yard", "mixed"])
def test_the_two_renderers_agree(
    name: str, color: bool, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opengl, "is_software", lambda: how == "quick")
    of = mixed_world() if name == "mixed" else make_world("yard", np.random.default_rng(3))
    raster, other = (make_renderer(r, of, CAMERA, color=color) for r in ("raster", "opengl"))
    mean, share, large = AGREEMENT[how]
    for one, two in zip(raster.images(views(of)), other.images(views(of)), strict=True):
        difference = np.abs(one.astype(np.float64) - two)
        assert one.std() > 15
        assert difference.mean() < mean
        assert (difference > 8).mean() < share
        assert (difference > 32).mean() < large


@needs_opengl
def test_the_same_bits_in_two_processes() -> None:
    hashes = {run(DRAW + "print(digest())") for _ in range(2)}
    assert len(hashes) == 1


DRAW = """
import hashlib, multiprocessing, sys
import numpy as np
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import lift
from grouser.rig import camera_mount

def digest(*_):
    world = make_world("yard", np.random.default_rng(3))
    camera = Pinhole.with_field_of_view(64, 48, 1.1)
    T = lift(world.start) @ camera_mount(0.2, 0.06, 0.4)
    renderer = make_renderer("opengl", world, camera, color=False)
    return hashlib.sha256(b"".join(i.tobytes() for i in renderer.images([T, T]))).hexdigest()
"""


@needs_opengl
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="threads are kept apart on Linux")
def test_the_software_driver_has_each_thread_on_a_processor_of_its_own() -> None:
    program = """
    import os, pathlib
    from grouser.envs.simulation.renderers.gl_context import is_software
    digest()
    tasks = pathlib.Path("/proc/self/task").iterdir()
    drawing = [int(t.name) for t in tasks if (t / "comm").read_text().startswith("llvmpipe")]
    processors = [os.sched_getaffinity(thread) for thread in drawing]
    n = min(len(drawing), len(os.sched_getaffinity(0)))
    apart = all(len(p) == 1 for p in processors) and len(set().union(*processors)) == n
    print(apart and bool(drawing) == is_software())
    """
    assert run(DRAW + textwrap.dedent(program)) == "True"


@needs_opengl
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_worker_processes_draw_the_same(method: str) -> None:
    """Environments are made in the parent and drawn in children: each makes its own context."""
    workers = f"""
    if __name__ == "__main__":
        with multiprocessing.get_context("{method}").Pool(2) as pool:
            children = set(pool.map(digest, range(2)))
        print(children == {{digest()}})
    """
    assert run(DRAW + textwrap.dedent(workers)) == "True"


@needs_opengl
def test_drawing_in_a_child_of_a_process_that_has_drawn_is_refused() -> None:
    """It would hang: the driver's threads do not survive a fork."""
    program = """
    import os
    digest()
    if os.fork() == 0:
        try:
            digest()
        except RuntimeError as error:
            print(error)
        sys.stdout.flush()
        os._exit(0)
    os.wait()
    """
    words = run(DRAW + textwrap.dedent(program))
    assert "do not survive a fork" in words
    assert "context='spawn'" in words and "renderer='raster'" in words


def run(program: str) -> str:
    """What a program prints in another process, run as a file so that it may spawn."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "program.py"
        path.write_text(program)
        done = subprocess.run([sys.executable, str(path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_without_moderngl_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(gl_context._CONTEXT, "owner", None)
    monkeypatch.setitem(sys.modules, "moderngl", None)
    renderer = make_renderer("opengl", mixed_world(), CAMERA, color=False)
    with pytest.raises(ImportError, match=r'pip install "grouser\[opengl\]"'):
        renderer.images(views(mixed_world()))
    renderer.close()


@pytest.mark.parametrize(
    ("complaint", "words"),
    [
        ("libEGL.so.1 not loaded", "needs the system library libEGL.so.1.*apt-get install libegl1"),
        ("libGL.so.1 not loaded", "needs the system library libGL.so.1.*apt-get install libgl1"),
        ("eglInitialize failed (0x3001)", "no OpenGL 3.3 driver.*libgl1-mesa-dri"),
    ],
)
def test_a_missing_library_is_named_with_its_package(
    monkeypatch: pytest.MonkeyPatch, complaint: str, words: str
) -> None:
    moderngl = pytest.importorskip("moderngl")

    def fail(**_: object) -> None:
        raise Exception(complaint)  # just that is what moderngl raises

    monkeypatch.setitem(gl_context._CONTEXT, "owner", None)
    monkeypatch.setattr(moderngl, "create_context", fail)
    with pytest.raises(RuntimeError, match=words):
        gl_context.shared_context()
