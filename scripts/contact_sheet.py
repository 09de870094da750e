"""A sheet of worlds: each from above, beside what the robot's camera sees, with a caption."""

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.sensors.schedule import Schedule
from grouser.envs.simulation.materials import MATERIAL_NAMES
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.relief import cell_slopes
from grouser.geometry import lift
from grouser.rig import StereoCamera
from grouser.scripts.world_overview import Overview

Image = NDArray[np.uint8]

_HEIGHT, _VIEW_WIDTH = 330, 440  # of the pictures, px
_GAP, _CAPTION = 10, 44  # px
_PAPER, _INK, _FADED = (250, 250, 248), (30, 30, 34), (96, 96, 104)
_TEXT_FINENESS = 2  # text is drawn so many times larger, then shrunk
_FEWEST_PERCENT = 2  # materials with less are not worth a word


def world_cell(world: World, title: str, words: str, *, renderer: str) -> Image:
    """One world: RGB (374, 780, 3), from above and from the camera over two lines of words."""
    pictures = np.full((_HEIGHT, _GAP, 3), _PAPER, dtype=np.uint8)
    above, seen = Overview(world, _HEIGHT).draw(), camera_view(world, renderer)
    caption = _caption(title, words, _GAP + _HEIGHT + _VIEW_WIDTH)
    return np.vstack([caption, np.hstack([above, pictures, seen])])


def sheet(cells: Sequence[Image], columns: int) -> Image:
    """All cells (of one size) in rows of so many, RGB."""
    height, width = cells[0].shape[:2]
    rows = -(-len(cells) // columns)
    size = rows * (height + _GAP) + _GAP, columns * (width + 2 * _GAP) + 2 * _GAP, 3
    paper = np.full(size, _PAPER, dtype=np.uint8)
    for k, cell in enumerate(cells):
        top = _GAP + k // columns * (height + _GAP)
        left = 2 * _GAP + k % columns * (width + 2 * _GAP)
        paper[top : top + height, left : left + width] = cell
    return paper


def camera_view(world: World, renderer: str) -> Image:
    """What the robot's left camera sees at the start, in colour, RGB (330, 440, 3)."""
    stereo = _stereo()
    camera = Pinhole(_VIEW_WIDTH, _HEIGHT, stereo.fx, stereo.fy, stereo.cx, stereo.cy)
    drawn = make_renderer(renderer, world, camera, color=True)
    try:
        return drawn.images([lift(world.start) @ stereo.T_base_camera])[0]
    finally:
        drawn.close()


def describe(world: World) -> str:
    """Ground, what stands on it, and relief, in one line."""
    obstacles = len(world.solids) - world.n_walls
    counts = {"obstacle": obstacles, "cylinder": len(world.cylinders), "slab": len(world.slabs)}
    things = [f"{n} {name}{'s' if n > 1 else ''}" for name, n in counts.items() if n]
    return ", ".join([_materials(world), *things, _relief(world)])


def _materials(world: World) -> str:
    """Those that cover the ground, the commonest first."""
    cells = np.bincount(world.ground.material.ravel(), minlength=len(MATERIAL_NAMES))
    percent = np.rint(100 * cells / cells.sum()).astype(int)
    most = sorted(range(len(percent)), key=lambda k: -percent[k])
    named = [(percent[k], MATERIAL_NAMES[k]) for k in most if percent[k] >= _FEWEST_PERCENT]
    return " + ".join(name if len(named) == 1 else f"{name} {share}%" for share, name in named)


def _relief(world: World) -> str:
    ground = world.ground
    if ground.is_level:
        return "level"
    steepest = math.degrees(math.atan(cell_slopes(ground.heights, ground.cell).max()))
    return f"relief {np.ptp(ground.heights):.1f} m, slopes up to {steepest:.0f} deg"


def _stereo() -> StereoCamera:
    """The robot's, with images of the sheet's size."""
    rig = robot_rig(
        RobotModel(),
        dt=0.1,
        image_size=(_VIEW_WIDTH, _HEIGHT),
        amounts=Schedule().steady,
    )
    assert rig.stereo is not None
    return rig.stereo


def _caption(title: str, words: str, width: int) -> Image:
    """Two lines, the lower one faded, on a strip (44, width, 3)."""
    large: Any = np.full((_CAPTION * _TEXT_FINENESS, width * _TEXT_FINENESS, 3), _PAPER, np.uint8)
    _write_line(large, title, 17, 0.55, _INK, thickness=2)
    _write_line(large, words, 36, 0.42, _FADED, thickness=1)
    return np.asarray(cv2.resize(large, (width, _CAPTION), interpolation=cv2.INTER_AREA), np.uint8)


def _write_line(
    large: Any, words: str, bottom: int, size: float, colour: tuple[int, int, int], thickness: int
) -> None:
    """Write words on the paper, smaller than asked for where they would not fit."""
    font, scale = cv2.FONT_HERSHEY_DUPLEX, size * _TEXT_FINENESS
    (needed, _), _ = cv2.getTextSize(words, font, scale, thickness)
    scale *= min(1.0, large.shape[1] / max(needed, 1))
    corner = (0, bottom * _TEXT_FINENESS)
    cv2.putText(large, words, corner, font, scale, colour, thickness, cv2.LINE_AA)
