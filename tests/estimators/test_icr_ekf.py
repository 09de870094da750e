"""Centres of rotation estimated online: found where something says how the robot turns, and as
uncertain as they are where nothing does."""

from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser import geometry
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.conformance import check_pose_estimator
from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.icr_ekf import IcrEkf
from grouser.estimators.icr_motion import icr_pose
from grouser.estimators.icr_predictor import IcrOptions
from grouser.estimators.synthetic_drive import RIG as SYNTHETIC_RIG
from grouser.estimators.synthetic_drive import synthetic_drive
from grouser.geometry import Array, between
from grouser.rig import Rig, TrackGeometry

RIG = Rig(dt=0.1, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=0.6))
CURVES = [(0.03, 0.05), (0.05, 0.03), (0.04, 0.04), (-0.02, 0.03), (0.02, 0.05), (0.05, 0.04)]


def run(estimator: Any, observations: list[dict[str, Any]]) -> list[PoseEstimate]:
    first = estimator.reset(observations[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(o) for o in observations[1:])]


def shown(du: Array, step: int) -> dict[str, Array]:
    return {"tracks": du, "stamp": np.array([step * RIG.dt])}


@cache
def driven(terrain: str, sensors: tuple[str, ...], steps: int) -> tuple[Rig, list[Any], list[Any]]:
    """Curves to either side on one ground."""
    env = gym.make("grouser/TrackedRobot-v0", terrain=terrain, sensors=sensors, dynamics="fast")
    seen, info = env.reset(seed=0)
    observations, infos = [seen], [info]
    for step in range(steps):
        action = [0.5, 0.9] if (step // 30) % 2 == 0 else [0.9, 0.5]
        seen, _, _, _, info = env.step(np.array(action, np.float32))
        observations.append(seen)
        infos.append(info)
    rig = env.get_wrapper_attr("rig")
    env.close()
    return rig, observations, infos


@pytest.mark.parametrize("terrain", ["asphalt", "grass"])
def test_with_a_pose_source_the_effective_width_is_found_to_two_percent(terrain: str) -> None:
    rig, observations, infos = driven(terrain, ("left", "right", "tracks"), 120)
    ill_informed = rig.with_overrides({"tracks.effective_width": 0.5})
    estimates = run(make("icr-ekf", ill_informed, source="one-point-ransac"), observations)
    assert {e.status for e in estimates} == {Status.TRACKING}
    steady = [k for k in range(60, 120) if k % 30 > 10]
    found = np.mean([estimates[k].diagnostics["effective_width"] for k in steady])
    truth = np.mean([infos[k]["effective_width"] for k in steady])
    assert abs(found / truth - 1) < 0.02
    for index, name in enumerate(("icr_left", "icr_right", "icr_x")):
        errors = [estimates[k].diagnostics[name] - infos[k]["icr"][index] for k in steady]
        assert np.abs(errors).mean() < 0.015
    truths = between(infos[0]["true_pose"], np.array([i["true_pose"] for i in infos]))
    poses, P = (np.array([getattr(e, a) for e in estimates]) for a in ("pose", "covariance"))
    assert nees(truths[1:], poses[1:], P[1:]).mean() < 7.8  # one drive: chi2_3(0.95)
    assert np.hypot(*(poses[-1] - truths[-1])[:2]) < 0.02


def test_a_gyroscope_finds_the_width_too() -> None:
    rig, observations, infos = driven("grass", ("tracks", "imu", "gps"), 120)
    ill_informed = rig.with_overrides({"tracks.effective_width": 0.5})
    estimates = run(make("icr-ekf", ill_informed, use_gps=False), observations)
    assert {e.status for e in estimates} == {Status.COASTING}
    last = [estimates[k].diagnostics["effective_width"] for k in range(105, 119)]
    truth = [infos[k]["effective_width"] for k in range(105, 119)]
    assert abs(np.mean(last) / np.mean(truth) - 1) < 0.02


def test_turns_on_the_spot_leave_the_gyroscopes_bias_alone() -> None:
    """The robot turns less on the spot than curves tell: that is a width, and no bias."""
    env = gym.make("grouser/TrackedRobot-v0", sensors=("tracks", "imu"), dynamics="fast")
    seen, info = env.reset(seed=0)
    observations = [seen]
    course = [([0.9, 0.6], 40), ([0.6, 0.9], 40), ([0.3, -0.3], 60)] * 3
    for action, n in course:
        for _ in range(n):
            seen, _, _, _, info = env.step(np.array(action, np.float32))
            observations.append(seen)
    last = run(make("icr-ekf", env.get_wrapper_attr("rig")), observations)[-1]
    env.close()
    off = abs(float(geometry.wrap(last.pose[2] - info["true_pose"][2])))
    assert off < np.radians(3.0)  # 12 without a width of its own on the spot
    assert abs(last.diagnostics["gyro_bias"]) < 1.5e-3


def test_fixes_bound_the_position_and_make_it_track() -> None:
    rig, observations, infos = driven("grass", ("tracks", "imu", "gps"), 120)
    ill_informed = rig.with_overrides({"tracks.effective_width": 0.5, "gps.sigma_position": 0.5})
    alone = run(make("icr-ekf", ill_informed, use_imu=False, use_gps=False), observations)
    fixed = run(make("icr-ekf", ill_informed, use_imu=False), observations)
    assert {e.status for e in fixed[1:]} == {Status.TRACKING}
    assert np.trace(fixed[-1].covariance[:2, :2]) < np.trace(alone[-1].covariance[:2, :2]) / 2
    truth = between(infos[0]["true_pose"], infos[-1]["true_pose"])
    error = fixed[-1].pose - truth
    error[2] = geometry.wrap(error[2])
    assert error @ np.linalg.solve(fixed[-1].covariance, error) < 16.3  # chi2_3(0.999)


def test_on_a_straight_drive_the_width_does_not_become_certain_and_in_a_curve_it_does() -> None:
    def width_sigma(du: tuple[float, float]) -> Array:
        """Of all frames from the first step on, with an imu that says what the tracks say."""
        rig = Rig(dt=0.1, tracks=RIG.tracks, imu=SYNTHETIC_RIG.imu)
        turn = (du[1] - du[0]) / 0.6
        imu = np.array([0.0, 0.0, 9.81, 0.0, 0.0, turn / 0.1])
        seen = [shown(np.array(du), k) | {"imu": imu} for k in range(100)]
        seen[0]["tracks"] = np.zeros(2)
        estimates = run(make("icr-ekf", rig), seen)
        return np.array([e.diagnostics["effective_width_sigma"] for e in estimates[1:]])

    straight, curve = width_sigma((0.04, 0.04)), width_sigma((0.03, 0.05))
    assert straight[-1] >= straight[0]
    assert curve[-1] < straight[-1] / 2


def test_without_a_source_it_is_dead_reckoning_that_is_honest_on_its_own_model() -> None:
    rng, runs = np.random.default_rng(0), 300
    options = IcrOptions(
        centre_walk=0.0, scale_walk=0.0, side_walk=0.0, spot_sigma=0.0, mirrored=False
    )
    commanded = np.repeat(CURVES, 8, axis=0)
    observations = [shown(np.zeros(2), 0)]
    observations += [shown(du, k) for k, du in enumerate(commanded, start=1)]
    last = run(IcrEkf(RIG, icr=options), observations)[-1]
    assert last.status is Status.COASTING
    found = np.empty(runs)
    for index in range(runs):
        centres = np.array([0.3, -0.3, 0.0]) + np.array([0.03, 0.03, 0.05]) * rng.normal(size=3)
        scales, across = 1 + 0.01 * rng.normal(size=2), 0.02 * rng.normal()
        truth, before = np.zeros(3), np.zeros(2)
        for du in commanded:
            sigma = np.hypot(np.hypot(0.015 * du, 2e-4), 0.3 * (du - before))
            moved = icr_pose(du * scales + sigma * rng.normal(size=2), centres)
            turn = moved[2]
            moved[:2] += across * np.array([-moved[1], moved[0]])
            moved[2] += 0.02 * turn * rng.normal()
            side = (0.01 * abs(du.mean()) + 0.005 * abs(turn) + 1e-5) * rng.normal()
            moved[:2] += side * np.array([-np.sin(turn / 2), np.cos(turn / 2)])
            truth, before = geometry.compose(truth, moved), du
        error = truth - last.pose
        error[2] = geometry.wrap(error[2])
        found[index] = error @ np.linalg.solve(last.covariance, error)
    assert abs(found.mean() - 3) < 3.3 * np.sqrt(6 / runs) + 0.3  # and what is not linear


def test_it_keeps_the_contract_with_a_source() -> None:
    check_pose_estimator("icr-ekf", source="one-point-ransac")


def test_the_covariance_has_no_jump_when_the_anchor_changes() -> None:
    drive = synthetic_drive(frames=30, blackout=range(30, 30))
    estimator = make("icr-ekf", SYNTHETIC_RIG, source="one-point-ransac")
    observations: list[Any] = list(drive.observations)
    traces = np.array([np.trace(e.covariance) for e in run(estimator, observations)])
    assert (np.diff(traces) > -0.4 * traces[1:].max()).all()
    assert np.diff(traces).max() < 0.4 * traces.max()


def test_what_it_cannot_do_without_is_said() -> None:
    with pytest.raises(ValueError, match=r"icr-ekf needs rig\.tracks, and this rig has None"):
        make("icr-ekf", Rig(dt=0.1))
    with pytest.raises(ValueError, match=r"CouplingOptions\.anchor_turn must be positive, got 0"):
        IcrEkf(RIG, anchor_turn=0.0)
    with pytest.raises(ValueError, match=r"requires observations .*without \['left', 'right'\]"):
        make("icr-ekf", SYNTHETIC_RIG, source="one-point-ransac").reset(
            shown(np.zeros(2), 0), rng=np.random.default_rng(0)
        )
    with pytest.raises(RuntimeError, match=r"call reset\(\) with the first observation before"):
        IcrEkf(RIG).update(shown(np.zeros(2), 1))
