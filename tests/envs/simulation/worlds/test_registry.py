"""Worlds by name: the same seed gives the same bits, options vary what they say and no more."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grouser.envs.simulation.materials import MATERIALS, material_index
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds import registry
from grouser.envs.simulation.worlds.placement import NoPlace
from grouser.envs.simulation.worlds.randomization import RANDOMIZABLE, randomization_strengths
from grouser.envs.simulation.worlds.registry import make_world, world_descriptions, world_names
from tests.envs.simulation.worlds.digest import digest

ROOT = Path(__file__).resolve().parents[4]


def made(name: str = "yard", seed: int = 0, **options: Any) -> World:
    return make_world(name, np.random.default_rng(seed), **options)


@pytest.mark.parametrize("name", world_names())
def test_a_seed_makes_a_world_and_another_makes_another(name: str) -> None:
    assert digest(made(name, 3)) == digest(made(name, 3))
    assert digest(made(name, 3)) != digest(made(name, 4))
    assert not np.array_equal(made(name, 3).start, made(name, 4).start)
    assert digest(made(name, 3, difficulty=0.2)) != digest(made(name, 3, difficulty=0.8))


def test_another_process_makes_the_same_bits() -> None:
    program = (
        "import numpy as np\n"
        "from grouser.envs.simulation.worlds.registry import make_world, world_names\n"
        "from tests.envs.simulation.worlds.digest import digest\n"
        "options = {'terrain': 'mixed', 'randomize': ['texture', 'light', 'friction', 'clutter']}\n"
        "for name in world_names():\n"
        "    print(digest(make_world(name, np.random.default_rng(0), **options)))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    options: dict[str, Any] = {
        "terrain": "mixed",
        "randomize": ["texture", "light", "friction", "clutter"],
    }
    assert done.stdout.split() == [digest(made(name, **options)) for name in world_names()]


@pytest.mark.parametrize("name", world_names())
def test_worlds_are_frozen(name: str) -> None:
    world = made(name)
    for array in (world.solids.centre, world.ground.heights, world.goals, world.start):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_every_world_is_described_in_one_line() -> None:
    descriptions = world_descriptions()
    assert sorted(descriptions) == world_names()
    assert all(20 < len(line) < 90 and "\n" not in line for line in descriptions.values())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"name": "yrad"}, r"no world is named 'yrad'; did you mean 'yard'\? known: .*yard"),
        ({"difficulty": 1.5}, r"difficulty must be in \[0, 1\], from easy to hard, got 1.5"),
        ({"difficulty": float("nan")}, r"difficulty must be in \[0, 1\], from easy to hard, got"),
        ({"difficulty": "hard"}, r"difficulty must be in \[0, 1\], from easy to hard, got 'hard'"),
        ({"terrain": "lava"}, "no terrain is named 'lava'; known: gravel, .*ice; or 'mixed'"),
        ({"randomize": ["lihgt"]}, r"named 'lihgt' can be randomised; did you mean 'light'\?"),
        ({"randomize": {"light": "a bit"}}, r"randomize\['light'\] must be in \[0, 1\], got 'a"),
        ({"randomize": {"light": 2}}, r"randomize\['light'\] must be in \[0, 1\], got 2"),
    ],
)
def test_what_there_is_not_is_refused_with_what_there_is(
    options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        made(**options)


def test_randomisation_is_named_or_given_a_strength() -> None:
    assert randomization_strengths(())["light"] == 0
    assert randomization_strengths("light") == randomization_strengths(["light"])
    strengths = randomization_strengths(json.loads(json.dumps({"light": 0.5, "texture": 1})))
    assert strengths == {**dict.fromkeys(RANDOMIZABLE, 0.0), "light": 0.5, "texture": 1.0}


@pytest.mark.parametrize("name", world_names())
def test_terrain_changes_the_ground_material_and_nothing_else(name: str) -> None:
    plain = made(name, 1)
    for terrain in ("mud", "mixed"):
        other = made(name, 1, terrain=terrain)
        assert digest(other, but=("ground",)) == digest(plain, but=("ground",))
        points = np.random.default_rng(0).uniform(-8, 8, (500, 2))
        np.testing.assert_allclose(other.ground.height(points), plain.ground.height(points))
        used = set(np.unique(other.ground.material_at(points)).tolist())
        assert used == ({material_index("mud")} if terrain == "mud" else set(range(len(MATERIALS))))


@pytest.mark.parametrize("name", world_names())
def test_each_randomisation_changes_what_it_says_whatever_else_is_on(name: str) -> None:
    def differing(world: World, other: World) -> set[str]:
        parts = ("solids", "cylinders", "slabs", "ground", "light", "start", "goals")
        return {part for part in parts if digest(world, only=part) != digest(other, only=part)}

    plain, dressed = made(name, 2), made(name, 2, randomize="texture")
    assert differing(plain, made(name, 2, randomize="light")) == {"light"}
    assert differing(plain, made(name, 2, randomize="friction")) == {"ground"}
    assert differing(plain, made(name, 2, randomize="sensor_noise")) == set()
    assert {"solids", "ground"} <= differing(plain, dressed) <= {
        "solids", "cylinders", "slabs", "ground"
    }  # fmt: skip
    assert np.array_equal(dressed.solids.centre, plain.solids.centre)
    both = made(name, 2, randomize=["light", "texture"])
    assert differing(both, dressed) == {"light"}
    assert digest(both, only="light") == digest(made(name, 2, randomize="light"), only="light")
    faint = made(name, 2, randomize={"light": 0.1}).light.direction
    strong = made(name, 2, randomize={"light": 1.0}).light.direction
    own = plain.light.direction
    assert np.dot(faint, own) > np.dot(strong, own)
    cluttered = made(name, 2, randomize="clutter")
    assert digest(cluttered, only="light") == digest(plain, only="light")


def test_clutter_and_friction_vary_around_what_they_were() -> None:
    counts, friction = [], []
    for seed in range(60):
        world = made("yard", seed, randomize=["clutter", "friction"])
        counts.append(len(world.solids) - world.n_walls)
        friction.append(world.ground.friction_scale)
    assert 20 <= min(counts) < 27 and 53 < max(counts) <= 60
    assert np.mean(counts) == pytest.approx(40, abs=5)
    assert np.mean(np.log(friction)) == pytest.approx(0, abs=0.1)
    assert np.std(np.log(friction)) == pytest.approx(0.25, abs=0.06)


def test_light_stays_within_what_a_camera_can_show() -> None:
    for seed in range(60):
        light = made("yard", seed, randomize="light").light
        assert np.linalg.norm(light.direction) == pytest.approx(1)
        assert light.direction[2] > 0.1
        assert 0 < light.ambient <= 1 - light.direct < 1
        assert 0 <= min(light.horizon.min(), light.zenith.min())
        assert max(light.horizon.max(), light.zenith.max()) <= 255


def test_a_world_without_reachable_goals_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the same generator of numbers, and not for ever."""
    own = registry._KINDS["yard"]
    tries: list[World] = []

    def unlucky(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
        if len(tries) == 1:
            tries.append(tries[0])
            raise NoPlace
        world = own.generate(rng, difficulty, clutter)
        tries.append(world)
        return replace(world, start=np.array([9.1, 0.0, 0.0])) if len(tries) < 4 else world

    monkeypatch.setitem(registry._KINDS, "yard", own._replace(generate=unlucky))
    world = made("yard", 5)
    assert len(tries) == 4 and len(world.goals) >= 5
    assert np.array_equal(world.solids.centre, tries[3].solids.centre)
    assert not np.array_equal(tries[2].solids.centre, tries[3].solids.centre)

    def hopeless(rng: np.random.Generator, difficulty: float, clutter: float) -> World:
        raise NoPlace

    monkeypatch.setitem(registry._KINDS, "yard", own._replace(generate=hopeless))
    with pytest.raises(RuntimeError, match="20 tries made no 'yard' of difficulty 0.5 with 5 goal"):
        made("yard")
