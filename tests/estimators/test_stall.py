"""Tracks that spin at a wall are felt, and a brake, a slope or a bump is not taken for one."""

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators import make
from grouser.estimators.icr_predictor import IcrOptions, IcrPredictor
from grouser.estimators.stall import StallingPredictor, StallWatch
from grouser.geometry import Array, between, wrap
from grouser.rig import TrackGeometry

DT, SPEED = 0.1, 0.35


def shown(speed: float, force: float, pitch_rate: float = 0.0) -> dict[str, Array]:
    du = np.full(2, speed * DT)
    return {"tracks": du, "imu": np.array([force, 0.0, 9.81, 0.0, pitch_rate, 0.0])}


def watched(*events: tuple[float, float, float]) -> StallWatch:
    """After a second of steady driving with a bias of the accelerometer, readings one by one."""
    watch = StallWatch(DT)
    for _ in range(12):
        watch.watch(shown(SPEED, 0.2))
    for speed, force, pitch_rate in events:
        watch.watch(shown(speed, 0.2 + force, pitch_rate))
    return watch


STOP = ((SPEED, -2.4, 0.0), (SPEED, -1.1, 0.0), (SPEED, 0.0, 0.0))


def test_a_stop_that_the_tracks_do_not_make_is_a_stall_until_they_stop() -> None:
    assert watched(*STOP).stalled
    assert watched(*STOP, *[(SPEED, 0.0, 0.0)] * 20).stalled
    assert not watched(*STOP, (0.0, 0.0, 0.0)).stalled
    assert not watched(*STOP, (-SPEED, 0.0, 0.0)).stalled


@pytest.mark.parametrize(
    "events",
    [
        [(SPEED, 0.0, 0.0)] * 20,
        [(0.2, -1.5, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 0.0)],  # a brake
        [(SPEED, -1.0, 0.0), (SPEED, 1.0, 0.0)],  # a bump
        [(SPEED, 2.4, 0.0), (SPEED, 1.1, 0.0)],  # a push
        # Over a kerb: the nose goes down by 0.2 rad and comes up again.
        [(SPEED, -0.98, 1.0), (SPEED, -1.96, 1.0), (SPEED, -0.98, -1.0), (SPEED, 0.0, -1.0)],
        [(SPEED, -9.81 * 0.05 * k, 0.5) for k in range(1, 6)],  # onto a ramp
    ],
)
def test_what_is_no_stall_is_none(events: list[tuple[float, float, float]]) -> None:
    watch = StallWatch(DT)
    for _ in range(12):
        watch.watch(shown(SPEED, 0.2))
    for speed, force, pitch_rate in events:
        watch.watch(shown(speed, 0.2 + force, pitch_rate))
        assert not watch.stalled


def test_who_is_seen_to_move_does_not_stall() -> None:
    tracks = TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6)
    predictor = StallingPredictor(IcrPredictor(tracks, IcrOptions()), DT)
    biases = np.zeros(7)
    for speed, force, rate in [(SPEED, 0.0, 0.0)] * 12 + list(STOP):
        increment = predictor.predict(shown(speed, 0.2 + force, rate), biases)
    assert not increment.pose.any() and not increment.by_biases.any()
    assert predictor.tell(biases, np.eye(7))["stalled"] == 1
    predictor.learn(np.array([0.001, 0.0, 0.0]))
    assert not predictor.predict(shown(SPEED, 0.2), biases).pose.any()
    predictor.learn(np.array([0.03, 0.0, 0.0]))
    assert predictor.predict(shown(SPEED, 0.2), biases).pose[0] > 0.03


def test_in_the_dark_a_robot_at_a_wall_knows_that_it_stands() -> None:
    ends = {}
    for watch_stalls in (True, False):
        env = gym.make(
            "grouser/TrackedRobot-v0",
            world="corridor",
            difficulty=0.0,
            sensors=("tracks", "imu"),
            dynamics="fast",
        )
        seen, info = env.reset(seed=0)
        rig, start = env.get_wrapper_attr("rig"), info["true_pose"]
        black = np.zeros((rig.stereo.height, rig.stereo.width, 1), np.uint8)
        estimator = make("vo-imu-gps", rig, watch_stalls=watch_stalls)
        dark = {"left": black, "right": black}
        estimator.reset({**seen, **dark}, rng=np.random.default_rng(0))
        for _ in range(80):
            seen, _, _, _, info = env.step(np.array([0.7, 0.7], np.float32))
            estimate = estimator.update({**seen, **dark})
        env.close()
        assert info["collision"]
        error = estimate.pose - between(start, info["true_pose"])
        error[2] = wrap(error[2])
        ends[watch_stalls] = float(np.hypot(error[0], error[1]))
        if watch_stalls:
            assert estimate.diagnostics["stalled"] == 1
            assert error @ np.linalg.solve(estimate.covariance, error) < 16.3  # chi2_3(0.999)
    assert ends[True] < 0.1 < 1.0 < ends[False]
