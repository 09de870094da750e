"""Images wait until all eyes saw the same moment, and each set is seen once."""

import numpy as np
import pytest

from grouser.estimators.base import Observation
from grouser.estimators.late_pictures import LatePictures


def shown(now: float, **stamps: float) -> Observation:
    """Images whose pixels say when they are of."""
    images = {eye: np.full((1, 1), stamp) for eye, stamp in stamps.items()}
    told = {f"{eye}_stamp": np.array([stamp]) for eye, stamp in stamps.items()}
    return {"stamp": np.array([now]), **images, **told}


def started() -> LatePictures:
    pictures = LatePictures(("left", "right"))
    pictures.reset({"stamp": np.zeros(1)})
    return pictures


def test_only_stamps_of_its_own_eyes_make_an_observation_late() -> None:
    assert started().may_be_late(shown(0.1, left=0.1))
    assert not started().may_be_late({"stamp": np.zeros(1), "gps_stamp": np.zeros(1)})


def test_a_pair_is_two_of_one_time() -> None:
    pictures = started()
    pictures.take(shown(0.2, left=0.2, right=0.1))
    assert pictures.newest() is None
    pictures.take(shown(0.3, left=0.3, right=0.2))
    assert pictures.newest() == pytest.approx(0.2)
    assert {eye: image.item() for eye, image in pictures.pop(0.2).items()} == {
        "left": 0.2,
        "right": 0.2,
    }
    assert pictures.newest() is None


def test_what_was_seen_or_skipped_does_not_come_back() -> None:
    pictures = started()
    pictures.take(shown(0.0, left=0.0, right=0.0))
    assert pictures.newest() is None  # the start was seen
    pictures.take(shown(0.2, left=0.2, right=0.2))
    pictures.skip(0.2)
    pictures.take(shown(0.3, left=0.2, right=0.2))
    assert pictures.newest() is None


def test_the_newest_up_to_a_time() -> None:
    pictures = started()
    for k in (1, 2, 3):
        pictures.take(shown(0.1 * k, left=0.1 * k, right=0.1 * k))
    assert pictures.newest(until=0.25) == pytest.approx(0.2)
    assert pictures.newest() == pytest.approx(0.3)


def test_one_eye_alone_keeps_a_bounded_number() -> None:
    pictures = started()
    for k in range(1, 200):
        pictures.take(
            {**shown(0.1 * k, left=0.1 * k), "right": np.zeros((1, 1))}
            | {"right_stamp": np.zeros(1)}
        )
    pictures.take(shown(20.0, left=20.0, right=0.1))
    assert pictures.newest() is None  # the first ones are gone
