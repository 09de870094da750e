"""One-point RANSAC finds the points that are right, however many are wrong."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.one_point import OnePointRansac, consensus, hypotheses_needed
from grouser.estimators.visual.prior import MotionPrior
from grouser.estimators.visual.refine import refine
from grouser.estimators.visual.solver import Hypothesis
from grouser.geometry import Array
from grouser.rig import camera_mount
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, pitch=0.17))
NOISE = np.full(6, 0.3**2)
RIGID = near_zero(1e-6, 1e-6, 1e-6, 1e-6)
TRUTH = six(0.03, 0.1)


@pytest.mark.parametrize(
    ("outlier_ratio", "needed"),
    [
        (0.0, 1), (0.1, 2), (0.2, 3), (0.3, 4), (0.4, 6), (0.5, 7), (0.6, 10), (0.7, 13),
        (0.8, 21), (0.9, 44),
    ],
)  # fmt: skip
def test_hypotheses_needed_as_in_the_table_of_the_spec(outlier_ratio: float, needed: int) -> None:
    assert hypotheses_needed(outlier_ratio) == needed


def solve(matches: Matches, rng: np.random.Generator) -> Hypothesis:
    found = OnePointRansac(CAMERA).solve(matches, RIGID, rng)
    assert found is not None
    return found


def cloud(rng: np.random.Generator, outlier_ratio: float, n: int = 64) -> tuple[Matches, int]:
    """Matches of which the first are wrong, and how many these are."""
    wrong = round(outlier_ratio * n)
    return matched(rng, CAMERA, TRUTH, n=n, noise=NOISE, outliers=wrong), wrong


@pytest.mark.parametrize("outlier_ratio", [0.0, 0.3, 0.5])
def test_recall_and_precision_with_the_refinement_that_follows(outlier_ratio: float) -> None:
    """SPEC's acceptance: .98 and .995. Alone, RANSAC still has points that turn and chord fit."""
    votes: list[list[int]] = []
    refined: list[list[int]] = []
    for rng in np.random.default_rng(0).spawn(200):
        matches, wrong = cloud(rng, outlier_ratio)
        found = solve(matches, rng)
        result = refine(
            matches.reference,
            matches.current,
            start=found.motion,
            supporters=found.inliers,
            prior=RIGID,
            noise=matches.noise,
            T_base_camera=CAMERA.T_base_camera,
            camera=intrinsics(CAMERA),
        )
        for inliers, counts in ((found.inliers, votes), (result.inliers, refined)):
            counts.append([inliers[wrong:].sum(), inliers.sum(), len(inliers) - wrong])
    for counts, enough in ((votes, 0.98), (refined, 0.995)):
        right, accepted, good = np.sum(counts, axis=0)
        assert right / good >= 0.98
        assert right / accepted >= enough


@pytest.mark.parametrize(("outlier_ratio", "failures"), [(0.5, 0), (0.7, 2), (0.8, 6)])
def test_failures_against_the_outlier_ratio(outlier_ratio: float, failures: int) -> None:
    """Of 200 clouds; a failure is a hypothesis that refinement could not start from."""
    failed = 0
    for rng in np.random.default_rng(1).spawn(200):
        error = np.abs(solve(cloud(rng, outlier_ratio)[0], rng).motion - TRUTH)
        failed += bool(error[0] > np.radians(1) or error[1] > 0.05)
    assert failed <= failures


def test_turn_and_chord_are_near_the_truth_and_nothing_else_moves() -> None:
    rngs = np.random.default_rng(2).spawn(100)
    motions = np.array([solve(cloud(rng, 0.3)[0], rng).motion for rng in rngs])
    errors = (motions - TRUTH).std(axis=0)
    assert errors[0] < np.radians(0.05) and errors[1] < 0.01
    assert not motions[:, 2:].any()


def test_the_generator_decides_and_nothing_else() -> None:
    """With more than 64 points the hypotheses are sampled."""
    matches = matched(np.random.default_rng(3), CAMERA, TRUTH, n=300, noise=NOISE, outliers=200)
    solver = OnePointRansac(CAMERA)

    def motion(seed: int) -> bytes:
        found = solver.solve(matches, RIGID, np.random.default_rng(seed))
        assert found is not None and 16 <= found.trials < 300
        return found.motion.tobytes() + found.inliers.tobytes()

    assert motion(0) == motion(0)
    assert len({motion(seed) for seed in range(6)}) > 1


def share_agreeing(prior: MotionPrior, pitch: float) -> float:
    """Share of perfect points that agree when the chassis pitches by `pitch` [rad]."""
    rng, kept = np.random.default_rng(4), []
    for _ in range(30):
        motion = six(0.03, 0.1, 0.0, 0.0, 0.0, pitch)
        matches = matched(rng, CAMERA, motion, noise=NOISE / 4)
        found = OnePointRansac(CAMERA).solve(matches, prior, rng)
        kept.append(0.0 if found is None else found.inliers.mean())
    return float(np.mean(kept))


def test_a_chassis_that_pitches_keeps_its_inliers_thanks_to_the_tolerance() -> None:
    tolerant = near_zero(0.001, 0.002, 0.003, 0.003)
    pitch = float(np.radians(0.2))
    assert share_agreeing(RIGID, 0.0) > 0.95
    assert share_agreeing(tolerant, pitch) > 0.95
    assert share_agreeing(RIGID, pitch) < 0.7


def test_a_path_that_was_no_arc_keeps_its_inliers_where_its_side_is_expected() -> None:
    """Left, then right: between two keyframes the robot ends up beside the chord of an arc."""
    truth = six(0.03, 0.2, 0.03)
    expected = MotionPrior(six(0.0, 0.0, 0.03), RIGID.sigma)
    aware, unaware = [], []
    for rng in np.random.default_rng(7).spawn(30):
        matches = matched(rng, CAMERA, truth, noise=NOISE / 4)
        found = OnePointRansac(CAMERA).solve(matches, expected, rng)
        assert found is not None and np.abs(found.motion - truth).max() < 0.01
        aware.append(found.inliers.mean())
        found = OnePointRansac(CAMERA).solve(matches, RIGID, rng)
        unaware.append(0.0 if found is None else found.inliers.mean())
    assert np.mean(aware) > 0.95
    assert np.mean(unaware) < 0.8


values = st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=30)


@given(values, st.integers(0, 100))
def test_consensus_is_the_weighted_mean_of_those_who_agree(numbers: list[float], seed: int) -> None:
    rng, v = np.random.default_rng(seed), np.array(numbers)
    sigmas = rng.uniform(0.01, 0.1, len(v))
    best, agree, trials = consensus(v, sigmas, rng)
    assert best is not None and agree.any() and trials == len(v)
    assert best == pytest.approx(np.average(v[agree], weights=sigmas[agree] ** -2.0))


@given(values, st.integers(0, 100))
def test_consensus_of_the_opposite_values_is_the_opposite(numbers: list[float], seed: int) -> None:
    rng, v = np.random.default_rng(seed), np.array(numbers)
    sigmas = rng.uniform(0.01, 0.1, len(v))
    best, agree, _ = consensus(v, sigmas, rng)
    opposite, agree_, _ = consensus(-v, sigmas, rng)
    assert best is not None and opposite == -best
    np.testing.assert_array_equal(agree, agree_)


def score(value: float, values: Array, sigmas: Array) -> float:
    """Truncated squared errors, as consensus weighs a candidate."""
    return float(np.minimum(((values - value) / sigmas) ** 2, 9).sum())


def test_consensus_is_nearly_as_good_as_trying_every_value() -> None:
    """The mean of those who agree may score a little worse than the best value: one point's."""
    rng, sigmas = np.random.default_rng(5), np.full(60, 0.01)
    for _ in range(100):
        v = np.concatenate([rng.normal(0.3, 0.01, 20), rng.uniform(-1, 1, 40)])
        best, _, _ = consensus(v, sigmas, rng)
        assert best is not None
        every = [score(candidate, v, sigmas) for candidate in v]
        assert score(best, v, sigmas) <= min(every) + 9
        assert best == pytest.approx(0.3, abs=0.012)


def test_hypotheses_are_sampled_by_their_precision() -> None:
    """Twenty sure values among a thousand vague ones: sampled evenly they would be missed."""
    rng = np.random.default_rng(8)
    sigmas = np.repeat([0.01, 1.0], [20, 980])
    for _ in range(30):
        v = np.concatenate([rng.normal(0.3, 0.01, 20), rng.uniform(-9, 9, 980)])
        best, agree, trials = consensus(v, sigmas, rng)
        assert best == pytest.approx(0.3, abs=0.05) and agree[:20].mean() > 0.8
        assert trials < 64


def test_values_without_a_finite_sigma_have_no_voice() -> None:
    rng = np.random.default_rng(6)
    v, sigmas = np.array([5.0, np.nan, 1.0, 5.0]), np.array([np.inf, 0.1, 0.1, np.nan])
    best, agree, _ = consensus(v, sigmas, rng)
    assert best == 1.0 and agree.tolist() == [False, False, True, False]
    none, agree, trials = consensus(v, np.full(4, np.inf), rng)
    assert none is None and not agree.any() and trials == 0


def test_without_a_match_there_is_no_hypothesis() -> None:
    nothing = Matches(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 6)), 0)
    assert OnePointRansac(CAMERA).solve(nothing, RIGID, np.random.default_rng(0)) is None
