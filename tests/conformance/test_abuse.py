"""Sensors that go wrong for a while end in COASTING or LOST, and in recovery: never confidently."""

from functools import cache

import numpy as np
import pytest

from grouser.estimators import Status, make, names
from grouser.estimators.base import OBSERVATION_KEYS
from grouser.estimators.evaluation.spoils import SPOILS, spoilt
from grouser.estimators.registry import estimator_class
from grouser.estimators.synthetic_drive import synthetic_drive
from grouser.estimators.visual.odometry import VisualOdometry
from grouser.scripts.abuse import Outcome, outcome, run

FRAMES, WINDOW = 36, range(12, 22)
BLINDING = [
    name for name in SPOILS if "track" not in name and name != "saturated"
]  # a saturated image still has edges
ODOMETRIES = [name for name in names() if estimator_class(name) is VisualOdometry]


@cache
def suffered(name: str, spoil: str | None, *, tracks: bool = True) -> Outcome:
    drive = synthetic_drive(frames=FRAMES, blackout=range(0))
    shown = list(drive.observations)
    if spoil is not None:
        shown = spoilt(shown, spoil, WINDOW, np.random.default_rng(0))
    keys = OBSERVATION_KEYS if tracks else OBSERVATION_KEYS - {"tracks"}
    seen = [{key: o[key] for key in keys & set(o)} for o in shown]
    return outcome(run(make(name, drive.rig), seen), drive.poses, WINDOW)


@pytest.mark.parametrize("spoil", SPOILS)
def test_nothing_makes_one_point_confidently_wrong(spoil: str) -> None:
    found = suffered("one-point-ransac", spoil)
    assert found.wrong == 0
    assert found.recovery is not None and found.recovery <= 4
    if spoil in BLINDING:
        assert found.statuses[Status.TRACKING] == 0 and found.growth > 2


@pytest.mark.parametrize("name", [n for n in ODOMETRIES if n != "one-point-ransac"])
@pytest.mark.parametrize("spoil", ["frozen", "swapped", "tracks silent", "tracks zero"])
def test_nothing_makes_its_rivals_wrong_more_often_than_they_are(name: str, spoil: str) -> None:
    found = suffered(name, spoil)
    assert found.wrong <= suffered(name, None).wrong
    assert found.recovery is not None and found.recovery <= 4


@pytest.mark.parametrize("spoil", ["black", "frozen", "swapped"])
def test_without_tracks_a_blinded_one_coasts_and_comes_back(spoil: str) -> None:
    found = suffered("one-point-ransac", spoil, tracks=False)
    assert found.statuses[Status.TRACKING] == 0 and found.growth > 2
    assert found.recovery is not None and found.recovery <= 4


def test_where_nothing_is_left_it_is_lost() -> None:
    found = suffered("one-point-ransac", "black, tracks silent")
    assert found.statuses[Status.COASTING] > 0 and found.growth > 10


def test_a_spoil_changes_its_window_alone() -> None:
    drive = synthetic_drive(frames=FRAMES, blackout=range(0))
    for name in SPOILS:
        shown = spoilt(drive.observations, name, WINDOW, np.random.default_rng(0))
        for index, (before, after) in enumerate(zip(drive.observations, shown, strict=True)):
            assert (after is before) == (index not in WINDOW)
            assert {k: v.shape for k, v in after.items()} == {k: v.shape for k, v in before.items()}
            assert {k: v.dtype for k, v in after.items()} == {k: v.dtype for k, v in before.items()}
