"""Increments about uncertain centres: their Jacobian, their noise, and what they refuse."""

import numpy as np
import pytest

from grouser.estimators.icr_motion import icr_pose, mirrored, on_the_spot
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.geometry import Array, compose, inverse
from grouser.rig import TrackGeometry

TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6)
BIASES = np.array([-0.03, 0.01, 0.04, 0.01, -0.02, 0.03, 0.02])
COURSES = [(0.03, 0.05), (0.05, 0.03), (-0.03, -0.05), (-0.02, 0.03), (0.004, 0.04), (0.04, 0.04)]


def shown(du: Array) -> dict[str, Array]:
    return {"tracks": du}


@pytest.mark.parametrize("is_mirrored", [True, False])
@pytest.mark.parametrize("du", COURSES)
def test_the_derivative_by_the_biases_is_that_of_finite_differences(
    du: tuple[float, float], is_mirrored: bool
) -> None:
    def pose(biases: Array) -> Array:
        predictor = IcrPredictor(TRACKS, IcrOptions(mirrored=is_mirrored))
        return predictor.predict(shown(np.array(du)), biases).pose

    predictor, h = IcrPredictor(TRACKS, IcrOptions(mirrored=is_mirrored)), 1e-7
    by_biases = predictor.predict(shown(np.array(du)), BIASES).by_biases
    for k in range(7):
        step = h * np.eye(7)[k]
        expected = (pose(BIASES + step) - pose(BIASES - step)) / (2 * h)
        assert np.abs(by_biases[:, k] - expected).max() < 1e-8


@pytest.mark.parametrize("du", [(0.03, 0.05), (-0.02, 0.03)])
def test_the_covariance_is_that_of_samples(du: tuple[float, float]) -> None:
    options = IcrOptions(track_noise=0.02, turn_noise=0.03, transient_noise=0.1)
    predictor, rng = IcrPredictor(TRACKS, options), np.random.default_rng(0)
    at_rest, tracks = np.zeros(2), np.array(du)
    predictor.predict(shown(at_rest), BIASES)
    increment = predictor.predict(shown(tracks), BIASES)
    felt = tracks * (1 + BIASES[3:5])
    apart = BIASES[6] * np.array([0.5, -0.5, 0.0])
    centres = mirrored(felt) @ (np.array([0.3, -0.3, 0.0]) + BIASES[:3]) + on_the_spot(felt) * apart
    turn = float(np.diff(felt)[0] / (centres[0] - centres[1]))
    sigma = np.hypot(np.hypot(0.02 * felt, 2e-4), 0.1 * tracks)
    errors = []
    for _ in range(20_000):
        noisy = felt + sigma * rng.normal(size=2)
        of_left_curve = np.array([0.3, -0.3, 0.0]) + BIASES[:3]
        wide = mirrored(noisy) @ of_left_curve + on_the_spot(noisy) * apart
        share = 0.03 * rng.normal()  # the same twist, and so much more of a turn
        pose = icr_pose(noisy, wide)
        pose[2] += share * turn
        pose[:2] += BIASES[5] * np.array([-pose[1], pose[0]])
        side = (0.01 * abs(float(felt.mean())) + 0.005 * abs(turn) + 1e-5) * rng.normal()
        pose[:2] += side * np.array([-np.sin(turn / 2), np.cos(turn / 2)])
        errors.append(pose - increment.pose)
    sampled = np.cov(np.array(errors).T)
    scale = np.sqrt(np.outer(np.diag(sampled), np.diag(sampled)))
    assert np.abs((increment.covariance - sampled) / scale).max() < 0.06


def test_a_mirrored_drive_ends_at_the_mirrored_pose() -> None:
    predictor = IcrPredictor(TRACKS, IcrOptions())
    biases = np.array([-0.03, 0.01, 0.04, 0.0, 0.0, 0.0, 0.02])
    left = predictor.predict(shown(np.array([0.03, 0.05])), biases).pose
    right = predictor.predict(shown(np.array([0.05, 0.03])), biases).pose
    assert right == pytest.approx(left * [1, -1, -1])
    back = predictor.predict(shown(np.array([-0.03, -0.05])), biases).pose
    assert compose(left, back) == pytest.approx(compose(back, left), abs=1e-3)
    assert np.sign(inverse(left)[2]) == np.sign(back[2])


def test_it_tells_the_centres_of_the_course_and_the_width_with_their_sigmas() -> None:
    predictor = IcrPredictor(TRACKS, IcrOptions())
    covariance = np.diag([0.01, 0.02, 0.03, 0.0, 0.0, 0.0, 0.0]) ** 2
    biases = np.append(BIASES[:6], 0.0)
    predictor.predict(shown(np.array([0.03, 0.05])), BIASES)
    told = predictor.tell(biases, covariance)
    assert told["icr_left"] == pytest.approx(0.27) and told["icr_right"] == pytest.approx(-0.29)
    assert told["effective_width"] == pytest.approx(0.56)
    assert told["effective_width_sigma"] == pytest.approx(np.hypot(0.01, 0.02))
    predictor.predict(shown(np.array([0.05, 0.03])), BIASES)
    right = predictor.tell(biases, covariance)
    assert right["icr_left"] == pytest.approx(0.29)
    assert right["icr_left_sigma"] == pytest.approx(told["icr_right_sigma"])


def test_the_width_on_the_spot_is_told_with_its_own_uncertainty() -> None:
    predictor = IcrPredictor(TRACKS, IcrOptions())
    covariance = np.diag([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01]) ** 2
    biases = np.append(np.zeros(6), 0.03)
    told = {}
    for du in ((-0.03, 0.03), (0.03, 0.05), (0.04, 0.04)):
        predictor.predict(shown(np.array(du)), biases)
        told[du] = predictor.tell(biases, covariance)
    assert told[-0.03, 0.03]["effective_width"] == pytest.approx(0.63)
    assert told[-0.03, 0.03]["effective_width_sigma"] == pytest.approx(0.01)
    assert 0.6 < told[0.03, 0.05]["effective_width"] < 0.61
    assert told[0.04, 0.04]["effective_width"] == pytest.approx(0.6)


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match=r"IcrOptions\.turn_noise must be zero or more, got -0\.1"):
        IcrOptions(turn_noise=-0.1)
    with pytest.raises(ValueError, match=r"IcrOptions\.centre_sigma must be positive, got 0"):
        IcrOptions(centre_sigma=0.0)
