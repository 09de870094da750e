"""The contact sheet shows what there is, where it is; misuse is refused in one line."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.simulation.materials import TEXTURES
from grouser.envs.simulation.renderers import registry
from grouser.envs.simulation.renderers.textures import texture_colours
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.scripts.cli import main
from grouser.scripts.contact_sheet import describe, sheet, world_cell
from grouser.scripts.world_overview import Overview

SIZE = 330
PAPER = np.array([250, 250, 248])


def made(name: str = "yard", seed: int = 0) -> World:
    return make_world(name, np.random.default_rng(seed))


def read(path: Path) -> NDArray[np.uint8]:
    image = cv2.imread(str(path))
    assert image is not None
    return np.asarray(image, dtype=np.uint8)


def test_the_sheet_has_a_cell_a_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "sheet.png"
    names = ["orchard", "rubble", "room"]
    assert main(["worlds", "--names", *names, "--output", str(output)]) == 0
    assert capsys.readouterr().out == f"{output}: 3 worlds\n"
    image = read(output)
    assert image.shape == (2 * (374 + 10) + 10, 2 * (780 + 20) + 20, 3)
    cells = [image[10:384, 20:800], image[10:384, 820:1600], image[394:768, 20:800]]
    assert all(len(np.unique(cell.reshape(-1, 3), axis=0)) > 500 for cell in cells)
    assert np.all(image[394:768, 820:1600] == image[0, 0]), "nothing where there is no fourth"


def test_variations_of_a_world_stand_side_by_side(tmp_path: Path) -> None:
    output = tmp_path / "sheet.png"
    options = ["--names", "yard", "--difficulty", "0", "1", "0.5", "--terrain", "mixed"]
    assert main(["worlds", *options, "--output", str(output)]) == 0
    image = read(output)
    assert image.shape[1] == 3 * (780 + 20) + 20
    first, last = image[60:384, 20:350], image[60:384, 1620:1950]
    assert np.mean(np.any(first != last, axis=-1)) > 0.1


def test_the_map_shows_goals_start_and_walls_where_they_are() -> None:
    """x to the right, y up."""
    world = made()
    picture = Overview(world, SIZE).draw()
    scale = SIZE / 18.6

    def colour(x: float, y: float) -> list[int]:
        row, column = SIZE / 2 - y * scale - 0.5, SIZE / 2 + x * scale - 0.5
        return list(picture[round(row), round(column)])

    for x, y in world.goals:
        ring = [colour(x + 3.5 / scale * dx, y + 3.5 / scale * dy) for dx, dy in [(1, 0), (0, 1)]]
        assert all(abs(r - 126) < 40 and abs(g - 44) < 40 and b > 120 for r, g, b in ring)
    r, g, b = colour(*world.start[:2])
    assert r > 200 and g < 120 and b < 80
    r, g, b = colour(9.15, -2.0)
    brick = texture_colours()[TEXTURES.index("brick")]
    assert np.allclose([r, g, b], brick, atol=1.5)
    inside = [colour(x, y) for x, y in np.random.default_rng(0).uniform(-8.9, 8.9, (200, 2))]
    gravel = texture_colours()[TEXTURES.index("gravel")]
    assert np.allclose(np.median(inside, axis=0), 0.55 * gravel + 0.45 * PAPER, atol=1.5)


def test_things_on_the_map_have_the_colour_of_their_texture() -> None:
    """Whatever it is: as the camera sees it."""
    world = made()
    largest = int(np.argmax(world.solids.half_extents[: -world.n_walls, :2].min(axis=1)))
    x, y = world.solids.centre[largest, :2]
    for texture in range(len(TEXTURES)):
        solids = replace(world.solids, texture=np.full(len(world.solids), texture))
        picture = Overview(replace(world, solids=solids), SIZE).draw()
        seen = picture[round(SIZE / 2 - y * SIZE / 18.6 - 0.5), round(SIZE / 2 + x * SIZE / 18.6)]
        assert np.allclose(seen, texture_colours()[texture], atol=1.5), TEXTURES[texture]


def test_the_map_follows_what_is_moved() -> None:
    world = made("forest")
    picture = Overview(world, SIZE).draw()
    turned = replace(world, start=world.start + [0.0, 0.0, 2.0])
    differing = np.any(Overview(turned, SIZE).draw() != picture, axis=-1)
    assert 0 < differing.sum() < 600, "the arrow and no more"
    bare = Overview(replace(world, goals=np.empty((0, 2))), SIZE).draw()
    assert 300 < np.any(bare != picture, axis=-1).sum() < 3000


def test_captions_tell_ground_things_and_relief() -> None:
    assert describe(made("yard")) == "gravel, 40 obstacles, level"
    words = describe(made("forest"))
    assert words.startswith("grass 90% + mud 10%, ")
    assert " cylinders, " in words and " slabs, relief " in words and " deg" in words
    assert "1 slab, level" in describe(made("room"))


def test_a_long_caption_is_written_smaller() -> None:
    """Where it would run over the edge, that is: the last words are as readable as the first."""
    world = made("rubble")
    ink = [
        np.flatnonzero(
            np.any(world_cell(world, "t", words, renderer="raster")[22:44] < 200, (0, 2))
        )
        for words in ("a word", "a word " * 20, "a word " * 30)
    ]
    assert ink[0].max() < 100
    assert all(740 < columns.max() < 780 for columns in ink[1:])


def test_cells_are_laid_out_row_by_row() -> None:
    cells = [np.full((4, 6, 3), value, np.uint8) for value in (10, 20, 30)]
    paper = sheet(cells, 2)
    assert paper.shape == (2 * 14 + 10, 2 * 26 + 20, 3)
    assert [paper[12, 22, 0], paper[12, 48, 0], paper[26, 22, 0]] == [10, 20, 30]


REFUSED = [
    (["--names", "forrest"], "no world is named 'forrest'; did you mean 'forest'? known: "),
    (["--difficulty", "1.5"], "difficulty must be in [0, 1], from easy to hard, got 1.5"),
    (["--terrain", "lava"], "no terrain is named 'lava'; known: gravel"),
    (["--randomize", "gravity"], "nothing named 'gravity' can be randomised; known: texture"),
    (["--seeds", "0"], "--seeds must be at least 1, got 0"),
    (["--renderer", "paint"], "no renderer is named 'paint'; known: raster"),
    (["--output", "sheet.jpg"], "--output must be a .png file, got sheet.jpg"),
    (["--output", "nowhere/sheet.png"], "--output: there is no folder "),
]


@pytest.mark.parametrize(("arguments", "words"), REFUSED)
def test_misuse_is_refused_in_one_line(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["worlds", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("grouser worlds: error: ") and words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir()), "nothing was begun"


@pytest.mark.parametrize(
    "arguments", [["worlds"], ["compare", "--estimators", "one-point-ransac", "--no-plots"]]
)
@pytest.mark.parametrize("lacking", [ImportError("no moderngl"), RuntimeError("no libEGL.so.1")])
def test_what_opengl_lacks_is_told_in_one_line(
    arguments: list[str],
    lacking: Exception,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def missing() -> None:
        raise lacking

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "require_opengl", missing)
    assert main([*arguments, "--renderer", "opengl"]) == 2
    error = capsys.readouterr().err
    assert error == f"grouser {arguments[0]}: error: {lacking}\n"
    assert not list(tmp_path.iterdir()), "nothing was begun"


def test_help_teaches_and_names_every_world(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["worlds", "--help"])
    assert stop.value.code == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    options = ["--names", "--difficulty", "--seeds", "--terrain", "--randomize", "--output"]
    for word in [*options, *world_names(), "grouser worlds --names forest rubble"]:
        assert word in text
