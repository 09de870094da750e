"""In the dark tracks are as noisy as they were seen to be, and slip as large as it may become."""

import numpy as np
import pytest

from grouser.estimators.visual.track_trust import TrackTrust
from grouser.estimators.visual.variance_factor import Innovation

OWN, SLIP = np.diag([1e-7, 1e-9, 1e-6]), np.diag([0.0, 1e-8, 4e-6])
VISION = 1e-8  # rad^2 of a turn


def driven(trust: TrackTrust, *, own: float, slip: float, ways: int, seed: int = 1) -> None:
    """Ways of 10 frames whose noise has so many times the assumed variances; slip is of a way."""
    rng, q, slips = np.random.default_rng(seed), OWN[2, 2], slip > 0
    for _ in range(ways):
        error = 0.0
        share = rng.normal(0, np.sqrt(slip * 10 * SLIP[2, 2])) / 10
        for frame in range(1, 11):
            error += rng.normal(0, np.sqrt(own * q)) + share
            assumed = frame * (q + (SLIP[2, 2] if slips else 0.0))
            seen = error + rng.normal(0, np.sqrt(VISION))
            trust.watch(frame, seen, assumed, VISION)
        Q = 10 * (OWN + (1.0 if slips else 0.0) * SLIP)
        others = 1e-4 * np.eye(2)  # vision tells little of the way
        S = Q.copy()
        S[:2, :2] += others
        S[2, 2] += VISION
        trust.end_way(Innovation(np.array([0.0, 0.0, seen]), S, Q))


def test_without_anything_seen_tracks_and_slip_are_as_assumed() -> None:
    trust = TrackTrust()
    np.testing.assert_allclose(trust.in_the_dark(OWN + SLIP, OWN), OWN + SLIP)
    np.testing.assert_allclose(trust.in_the_dark(OWN + SLIP, 0 * OWN), OWN + SLIP)


def test_the_noise_that_the_tracks_had_in_sight_is_theirs_in_the_dark() -> None:
    trust = TrackTrust()
    driven(trust, own=0.3, slip=0.0, ways=30)
    own = trust.in_the_dark(OWN, OWN)[2, 2] / OWN[2, 2]
    assert own == pytest.approx(0.3, rel=0.3)


def test_slip_that_was_not_there_in_sight_may_come_in_the_dark() -> None:
    trust = TrackTrust()
    driven(trust, own=0.05, slip=0.0, ways=30)
    of_slip = trust.in_the_dark(SLIP, 0 * OWN)
    np.testing.assert_allclose(of_slip, SLIP)


def test_slip_that_lasts_shows_over_a_way_and_goes_on_in_the_dark() -> None:
    trust = TrackTrust()
    driven(trust, own=0.3, slip=20.0, ways=30)
    assert trust.in_the_dark(SLIP, 0 * OWN)[2, 2] > 5 * SLIP[2, 2]
