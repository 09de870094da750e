"""A recipe makes worlds with the same arguments, and scales the sensors' noises."""

import numpy as np
import pytest

from grouser.envs.simulation.worlds.recipe import WorldRecipe
from grouser.envs.simulation.worlds.registry import make_world


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_it_makes_what_make_world_makes() -> None:
    recipe = WorldRecipe("garden", 0.7, "mud", iter(["light"]))
    direct = make_world("garden", rng(), difficulty=0.7, terrain="mud", randomize={"light": 1.0})
    for _ in range(2):  # an iterator is not used up
        made = recipe.make(rng())
        assert np.array_equal(made.light.direction, direct.light.direction)
        assert np.array_equal(made.ground.material, direct.ground.material)


def test_noise_is_halved_at_least_and_doubled_at_most() -> None:
    full, none = WorldRecipe("yard", randomize=["sensor_noise"]), WorldRecipe("yard")
    scales = [full.noise_scale(child) for child in rng().spawn(1000)]
    assert 0.5 <= min(scales) < 0.55 and 1.8 < max(scales) <= 2
    assert np.log2(scales).mean() == pytest.approx(0, abs=0.1)
    assert {none.noise_scale(rng(seed)) for seed in range(5)} == {1.0}


def test_arguments_are_checked_when_they_are_given() -> None:
    with pytest.raises(ValueError, match="difficulty must be in"):
        WorldRecipe("yard", difficulty="hard")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"randomize\['light'\] must be in \[0, 1\], got 2"):
        WorldRecipe("yard", randomize={"light": 2})
