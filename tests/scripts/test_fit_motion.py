"""The light model slips as the physics does, and a fit to the physics finds the shared ground."""

import json
from pathlib import Path

import numpy as np
import pytest

from grouser.scripts.cli import main
from grouser.scripts.fit_motion_work import Pair, compare
from grouser.scripts.motion_drives import MEASURES, Setting, commands, drive, slips, twists
from grouser.scripts.motion_fit import fit, scaled

SPEEDS = commands()
SHORT = SPEEDS[:240]


@pytest.mark.parametrize("setting", [Setting("gravel", 0.0), Setting("mud", 0.08)], ids=str)
def test_slip_is_distributed_alike(setting: Setting) -> None:
    pair, _ = compare(setting, SPEEDS)
    assert len(pair.bullet["side"]) > 800 and len(pair.bullet["yaw"]) > 500
    for measure in MEASURES:
        assert pair.distance(measure) < 0.03, measure
    assert pair.farthest("slip") < 0.01 and pair.farthest("yaw") < 0.01


def test_another_ground_is_told_by_its_slip() -> None:
    """The distance is no formality: a tenth more shear modulus shows."""
    setting = Setting("mud", 0.0)
    softer = scaled(setting, np.array([1.0, 1.1, 1.0]))
    here = slips(drive(setting, SPEEDS, dynamics="fast"))
    there = slips(drive(setting, SPEEDS, dynamics="fast", materials=softer))
    assert Pair(setting, here, there).distance("slip") > 0.03


def test_a_fit_to_the_physics_finds_the_shared_ground() -> None:
    setting = Setting("grass", 0.08)
    motion = twists(drive(setting, SHORT, dynamics="bullet"))
    found = fit(setting, SHORT, motion)
    assert found.factors == pytest.approx([1, 1, 1], abs=0.03)
    assert (found.rms < [0.003, 0.003, 0.006]).all()


def test_a_fit_finds_a_ground_that_is_not_shared() -> None:
    setting, true = Setting("grass", 0.08), np.array([0.9, 1.2, 0.7])
    drawn = drive(setting, SHORT, dynamics="fast", materials=scaled(setting, true))
    found = fit(setting, SHORT, twists(drawn))
    assert found.factors == pytest.approx(true, abs=0.01)


def test_commands_are_of_all_speeds_to_both_sides() -> None:
    once = SPEEDS[::12]
    assert len(np.unique(once, axis=0)) == 60  # 3 speeds, 6 turns, 4 ways less what coincides
    assert np.abs(once.mean(axis=0)).max() < 1e-12
    assert np.abs(once).max() == 0.5


def test_the_command_tells_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fit-motion", "--terrains", "cement", "--output", str(tmp_path)]) == 0
    told = json.loads((tmp_path / "agreement.json").read_text())
    assert len(told["slip"]) == 2 * len(MEASURES) and len(told["fit"]) == 1
    assert all(row["ks_distance"] < 0.05 for row in told["slip"])
    assert (tmp_path / "motion.png").stat().st_size > 20_000
    assert "cement" in capsys.readouterr().out
    assert main(["fit-motion", "--terrains", "cemnt"]) == 2
    assert "no terrain is named 'cemnt'; did you mean 'cement'" in capsys.readouterr().err
