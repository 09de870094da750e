"""What is kept of a drive: figures that are no surprise where the drive is none."""

import numpy as np
import pytest

from grouser.scripts.reproduction.experiment import Outcome
from grouser.scripts.reproduction.yan.drives import course
from grouser.scripts.reproduction.yan.forms import FORMS, RIVALS
from grouser.scripts.reproduction.yan.monte_carlo import MonteCarlo, blocks, joined
from grouser.scripts.reproduction.yan.paper import OBSERVING_EVERY

SIGMA = 0.3
FORM = "right-invariant"


def run(forms: dict, **options: float) -> Outcome:  # type: ignore[type-arg]
    return MonteCarlo("test", "yan-normal", forms, (0,), **options).run(lambda: None)


@pytest.fixture(scope="module")
def exact() -> Outcome:
    return run({FORM: FORMS[FORM], "reckoning": RIVALS["reckoning"]})


@pytest.fixture(scope="module")
def turned() -> Outcome:
    return run({FORM: FORMS[FORM]}, start_sigma=SIGMA)


def test_there_is_a_look_every_so_many_steps(exact: Outcome) -> None:
    looks = len(course("yan-normal")) // OBSERVING_EVERY
    for figure in ("nees", "plane_nees", "nis_sum", "matched", "heading_sigma"):
        assert exact[f"{FORM}.{figure}"].shape == (1, looks)


def test_lines_make_the_way_known(exact: Outcome) -> None:
    assert exact[f"{FORM}.rms"] < exact["reckoning.rms"] / 2
    assert exact[f"{FORM}.landmarks"] == 4 and exact["reckoning.matched"].sum() == 0
    assert exact[f"{FORM}.third_end"] == pytest.approx(45, abs=1)
    assert exact[f"{FORM}.line_r"] < 0.5


def test_a_start_that_is_turned_stays_so(exact: Outcome, turned: Outcome) -> None:
    """The filter saw the same, and knows that nothing told it of the turn."""
    turn = SIGMA * np.random.default_rng([0, 1]).standard_normal()
    assert turned[f"{FORM}.heading_rms"] == pytest.approx(abs(turn), abs=0.02)
    assert turned[f"{FORM}.heading_sigma"].min() > 0.95 * SIGMA
    assert exact[f"{FORM}.heading_rms"] < 0.02
    assert f"{FORM}.third_end" not in turned, "the map's frame is not known"


def test_blocks_are_joined_in_order() -> None:
    made = blocks("drives", "yan-normal", FORMS, 12)
    assert [seed for block in made for seed in block.seeds] == list(range(12))
    assert len({block.name for block in made}) == len(made) > 1
    outcomes = {block.name: {"x": np.array(block.seeds)} for block in made}
    np.testing.assert_array_equal(joined(outcomes, made)["drives"]["x"], np.arange(12))
