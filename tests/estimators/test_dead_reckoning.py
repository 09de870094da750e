"""Dead reckoning: exact on its own model, and honest about how far it may be off."""

from collections.abc import Iterator

import gymnasium as gym
import numpy as np
import pytest

from grouser import geometry
from grouser.estimators import Status, make
from grouser.estimators.base import PoseEstimate
from grouser.estimators.dead_reckoning import DeadReckoning, outward_slip, turn_drag
from grouser.estimators.slope import SlopeOptions, unknown_covariance
from grouser.estimators.track_motion import SideSlip, TrackNoise, arc_pose, chord, track_increment
from grouser.geometry import Array
from grouser.rig import Rig, TrackGeometry

WIDTH = 0.55
# The defaults of the estimator:
TRACK_SCALE, TURN_SCALE, OUTWARD_SLIP, TURN_DRAG = 0.01, 0.05, 0.03, 0.03
RIG = Rig(dt=0.1, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=WIDTH))


def observation(du: Array, step: int) -> dict[str, Array]:
    return {"tracks": du, "stamp": np.array([step * RIG.dt])}


def run(estimator: DeadReckoning, increments: Array) -> Iterator[PoseEstimate]:
    rng = np.random.default_rng(0)
    yield estimator.reset(observation(np.zeros(2), 0), rng=rng)
    for step, du in enumerate(increments, start=1):
        yield estimator.update(observation(du, step))


def drive(steps: int) -> Array:
    """(steps, 2) increments: straight, a left and a right bend, reverse, a spot turn."""
    pieces = [[0.04, 0.04], [0.03, 0.05], [0.05, 0.03], [-0.04, -0.03], [-0.02, 0.02]]
    return np.repeat(pieces, steps // len(pieces), axis=0)


def simulated_nees(rng: np.random.Generator, runs: int, **options: float) -> Array:
    """(runs,) NEES after a drive whose errors are drawn from the estimator's own model."""
    track_noise, side_slip = TrackNoise(), SideSlip()
    commanded = drive(60)
    nees = np.empty(runs)
    for index in range(runs):
        scale = 1 + TRACK_SCALE * rng.normal(size=2)
        turn_scale = 1 + TURN_SCALE * rng.normal()
        slip_per_turn, drag_per_turn = OUTWARD_SLIP * rng.normal(), TURN_DRAG * rng.normal()
        truth = np.zeros(3)
        for du in commanded:
            sigma = np.sqrt(np.diag(track_noise.covariance(du)))
            turn, arc_length = track_increment(du * scale + sigma * rng.normal(size=2), WIDTH)
            turn *= turn_scale
            arc_length -= drag_per_turn * turn_drag(turn, arc_length, WIDTH)
            slip = side_slip.sigma(turn, chord(turn, arc_length)) * rng.normal()
            step = arc_pose(turn, arc_length)
            step[:2] += slip * np.array([-np.sin(turn / 2), np.cos(turn / 2)])
            step += slip_per_turn * outward_slip(turn, arc_length, WIDTH)
            step += rng.multivariate_normal(
                np.zeros(3), unknown_covariance(turn, WIDTH, SlopeOptions())
            )
            truth = geometry.compose(truth, step)
        *_, last = run(DeadReckoning(RIG, **options), commanded)
        error = geometry.between(last.pose, truth)
        in_world = geometry.rotate(last.pose[2], error[:2])
        error = np.append(in_world, error[2])
        nees[index] = error @ np.linalg.solve(last.covariance, error)
    return nees


def test_nees_is_three_on_its_own_noise_model() -> None:
    runs = 400
    nees = simulated_nees(np.random.default_rng(0), runs)
    # The sum of `runs` independent chi-square(3) has standard deviation sqrt(6 runs): 3.3 sigma.
    assert abs(nees.mean() - 3) < 3.3 * np.sqrt(6 / runs)
    assert (nees > 11.345).mean() < 0.025  # one per cent lies above chi2_3(0.99)


def test_without_constant_errors_the_covariance_is_far_too_small() -> None:
    white_only = simulated_nees(
        np.random.default_rng(0),
        100,
        track_scale_sigma=0.0,
        turn_scale_sigma=0.0,
        outward_slip_sigma=0.0,
        turn_drag_sigma=0.0,
    )
    assert white_only.mean() > 6


@pytest.mark.parametrize("tracks", [(0.4, 0.8), (0.6, 0.5), (-0.3, -0.6), (0.0, 0.6), (-0.3, 0.3)])
def test_it_is_honest_on_the_simulated_robot_whose_slip_is_no_white_noise(
    tracks: tuple[float, float],
) -> None:
    env = gym.make("grouser/TrackedRobot-v0", sensors=("tracks",))
    action, nees = np.array(tracks, dtype=np.float32), []
    try:
        shown, info = env.reset(seed=0)
        start = info["true_pose"]
        estimator = make("dead-reckoning", env.get_wrapper_attr("rig"))
        estimator.reset(shown, rng=np.random.default_rng(0))
        for _ in range(80):
            shown, _, _, _, info = env.step(action)
            estimate = estimator.update(shown)
            error = geometry.between(start, info["true_pose"]) - estimate.pose
            error[2] = geometry.wrap(error[2])
            nees.append(error @ np.linalg.solve(estimate.covariance, error))
    finally:
        env.close()
    assert np.mean(nees[10:]) < 7.8  # chi2_3(0.95): one drive is one sample of the constant errors


def test_noise_free_increments_give_the_exact_arc() -> None:
    du, steps = np.array([0.03, 0.05]), 200
    *_, last = run(DeadReckoning(RIG), np.tile(du, (steps, 1)))
    expected = geometry.exp([0.04 * steps, 0.0, 0.02 / WIDTH * steps])
    assert np.abs(last.pose - expected).max() < 1e-12


def test_covariance_matches_a_numeric_propagation() -> None:
    """Perturb every noise input of a drive in turn; first order must add up to the covariance."""
    commanded, h = drive(10), 1e-6
    noise, side_slip = TrackNoise(), SideSlip()

    def end(inputs: Array) -> Array:
        scales, white = inputs[:5], inputs[5:].reshape(-1, 6)
        pose = np.zeros(3)
        for du, (left, right, side, *slip) in zip(commanded, white, strict=True):
            actual = du * (1 + scales[:2]) + [left, right]
            turn, arc_length = track_increment(actual, WIDTH)
            turn += scales[2] * turn
            arc_length -= scales[4] * turn_drag(turn, arc_length, WIDTH)
            step = arc_pose(turn, arc_length)
            step[:2] += side * np.array([-np.sin(turn / 2), np.cos(turn / 2)])
            step += scales[3] * outward_slip(turn, arc_length, WIDTH) + slip
            pose = geometry.compose(pose, step)
        return pose

    constants = [TRACK_SCALE, TRACK_SCALE, TURN_SCALE, OUTWARD_SLIP, TURN_DRAG]
    variances = [sigma**2 for sigma in constants]
    for du in commanded:
        turn, arc_length = track_increment(du, WIDTH)
        variances += [
            *np.diag(noise.covariance(du)),
            side_slip.sigma(turn, chord(turn, arc_length)) ** 2,
            *np.diag(unknown_covariance(turn, WIDTH, SlopeOptions())),
        ]
    steps = np.eye(len(variances)) * h
    J = np.stack([(end(step) - end(-step)) / (2 * h) for step in steps], axis=-1)
    *_, last = run(DeadReckoning(RIG), commanded)
    assert np.abs(last.covariance - J @ np.diag(variances) @ J.T).max() < 1e-9


def test_outward_slip_points_away_from_the_turn_and_fades_on_the_spot() -> None:
    left, right = outward_slip(0.01, 0.1, WIDTH), outward_slip(-0.01, 0.1, WIDTH)
    assert left[1] < 0 < right[1]
    reverse = outward_slip(0.01, -0.1, WIDTH)  # reversing to the left, the outside is on the right
    assert reverse[1] > 0
    assert np.abs(left[:2]).max() == pytest.approx(0.01, rel=2e-3)  # 1 m per rad
    assert not outward_slip(0.1, 0.0, WIDTH).any()
    assert not outward_slip(0.0, 0.0, WIDTH).any()


def test_drag_shortens_the_way_and_fades_on_the_spot() -> None:
    for turn in (0.01, -0.01):
        assert turn_drag(turn, 0.1, WIDTH) == 0.01  # 1 m per rad
        assert turn_drag(turn, -0.1, WIDTH) == -0.01
        halfway = abs(turn) * WIDTH / 4
        assert turn_drag(turn, halfway, WIDTH) == pytest.approx(0.005)
    assert turn_drag(0.1, 0.0, WIDTH) == turn_drag(0.0, 0.1, WIDTH) == 0


def test_uncertainty_grows_while_driving_and_never_claims_to_track() -> None:
    estimates = list(run(DeadReckoning(RIG), drive(50)))
    traces = [np.trace(estimate.covariance) for estimate in estimates]
    assert traces[0] == 0.0 and traces[-1] > 1e-3
    headings = [estimate.covariance[2, 2] for estimate in estimates[:20]]
    assert (np.diff(headings) > 0).all()
    assert {estimate.status for estimate in estimates} == {Status.COASTING}
    assert [estimate.stamp for estimate in estimates[:3]] == pytest.approx([0.0, 0.1, 0.2])


def test_reset_forgets_the_previous_drive() -> None:
    estimator = DeadReckoning(RIG)
    *_, first = run(estimator, drive(20))
    *_, again = run(estimator, drive(20))
    assert np.array_equal(first.pose, again.pose)
    assert np.array_equal(first.covariance, again.covariance)


def test_a_rig_without_tracks_is_refused_with_the_remedy() -> None:
    with pytest.raises(
        ValueError, match=r"dead reckoning needs rig\.tracks or rig\.odometry, .* pass an"
    ):
        make("dead-reckoning", Rig(dt=0.1))


@pytest.mark.parametrize("sigma", [-0.1, np.nan, np.inf])
def test_a_sigma_out_of_range_is_refused(sigma: float) -> None:
    with pytest.raises(ValueError, match="every sigma must be finite and zero or more"):
        DeadReckoning(RIG, turn_scale_sigma=sigma)


def test_an_update_before_the_reset_is_refused() -> None:
    with pytest.raises(RuntimeError, match=r"call reset\(\) with the first observation before upd"):
        DeadReckoning(RIG).update(observation(np.zeros(2), 0))


@pytest.mark.parametrize("bad", [np.array([np.nan, 0.0]), np.zeros(3)])
def test_bad_increments_are_refused(bad: Array) -> None:
    estimator = DeadReckoning(RIG)
    estimator.reset(observation(np.zeros(2), 0), rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match="'tracks' must be two finite numbers"):
        estimator.update(observation(bad, 1))
