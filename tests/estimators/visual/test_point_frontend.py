"""Points from elsewhere: found by identity, seen from between the eyes, spread over the image."""

import numpy as np

from grouser.estimators.visual.matching import MatchingOptions, Prediction
from grouser.estimators.visual.point_frontend import PointFrontend, eyes_noise, middle_eye
from tests.estimators.visual.clouds import moved, scattered, seen, six, stereo

LEFT = stereo()
CAMERA = middle_eye(LEFT)
NOISE = eyes_noise(0.3)
NOWHERE = Prediction(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3, 3)))


def frontend(most: int = 64) -> PointFrontend:
    return PointFrontend(CAMERA, noise=NOISE, matching=MatchingOptions(max_points=most))


def test_the_middle_eye_sees_half_the_disparity_to_the_left() -> None:
    points = scattered(np.random.default_rng(0), 50, LEFT)
    to_middle = LEFT.T_camera_base @ CAMERA.T_base_camera
    shifted = points - to_middle[:3, 3]
    left, middle = seen(points, LEFT), seen(shifted, CAMERA)
    np.testing.assert_allclose(middle, left - left[:, 2:] * [0.5, 0.0, 0.0], atol=1e-12)


def test_noise_of_the_eyes_is_uncorrelated_there_and_as_large_as_said() -> None:
    eyes = 0.3 * np.random.default_rng(1).normal(size=(40000, 3))  # u left, v, u right
    disparity = eyes[:, 0] - eyes[:, 2]
    drawn = np.cov(np.stack([eyes[:, 0] - disparity / 2, eyes[:, 1], disparity]))
    np.testing.assert_allclose(drawn, np.diag(NOISE[:3]), atol=0.004)


def test_points_are_found_by_identity_with_what_they_are_mistaken_for() -> None:
    rng, ids = np.random.default_rng(2), np.arange(30)
    points = scattered(rng, 30, LEFT)
    first = {"points": seen(points, CAMERA), "identities": ids}
    there = seen(moved(points, six(0.02, 0.1), CAMERA.T_base_camera), CAMERA)
    shuffled = rng.permutation(30)[:20]
    wrong = there[shuffled] + [5.0, 0.0, 0.0]
    second = {"points": there[shuffled], "identities": ids[shuffled], "mismatched": wrong}
    front = frontend()
    keyframe, frame = front.make_keyframe(front.extract(first)), front.extract(second)
    matches = front.match(keyframe, frame, NOWHERE)
    assert matches.candidates == len(matches.reference) == 20
    for before, now in zip(matches.reference, matches.current, strict=True):
        found = np.flatnonzero((first["points"] == before).all(axis=1))
        np.testing.assert_array_equal(now, there[found[0]] + [5.0, 0.0, 0.0])
    np.testing.assert_array_equal(matches.noise, np.tile(NOISE, (20, 1)))
    np.testing.assert_array_equal(front.make_keyframe(frame).points, there[shuffled])


def test_of_many_points_the_wanted_number_is_used() -> None:
    shown = {
        "points": seen(scattered(np.random.default_rng(3), 200, LEFT), CAMERA),
        "identities": np.arange(200),
    }
    front = frontend(most=40)
    frame = front.extract(shown)
    matches = front.match(front.make_keyframe(frame), frame, NOWHERE)
    assert len(matches.reference) == 40 and matches.candidates == 200


def test_nothing_in_view_is_no_match() -> None:
    dark = {"points": np.zeros((0, 3)), "identities": np.zeros(0, dtype=int)}
    front = frontend()
    frame = front.extract(dark)
    assert len(front.match(front.make_keyframe(frame), frame, NOWHERE).reference) == 0
