"""Paper 2's run to the number, where noise enters and where not, moments kept, words of errors."""

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import grouser  # noqa: F401  registers
from grouser.agents.steering import SteeringDriver
from grouser.envs.line_world import LineWorldEnv
from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import compose, wrap

ACTIONS = np.random.default_rng(3).uniform(-1, 1, (60, 2))


def papers_run(**options: Any) -> list[dict[str, Any]]:
    """info of every step of the paper's course, by its driver."""
    env = LineWorldEnv(**options)
    driver = SteeringDriver(env.rig, env.world.course)
    infos = [env.reset(seed=0)[1]]
    while True:
        seen = PoseEstimate(infos[-1]["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
        action = driver(seen)
        if action is None:
            return infos
        infos.append(env.step(action.astype(np.float32))[4])


def test_the_papers_run_takes_2296_steps_and_sees_the_third_line_up_to_54_17() -> None:
    infos = papers_run(world="yan-over-range", noise=0.0)
    poses = np.array([info["true_pose"] for info in infos])
    way = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum()
    right_end = np.max([info["true_visible"][2, 2] for info in infos])
    assert len(infos) - 1 == 2296
    assert way == pytest.approx(172.2, abs=0.1)
    assert right_end == pytest.approx(54.1658, abs=1e-4)
    every_step = papers_run(world="yan-over-range", observe_every=1)
    right_end = np.max([info["true_visible"][2, 2] for info in every_step])
    assert right_end == pytest.approx(54.166, abs=0.01)


def test_in_the_normal_run_the_third_line_is_seen_to_its_end() -> None:
    infos = papers_run(world="yan-normal")
    assert np.max([info["true_visible"][2, 2] for info in infos]) == pytest.approx(45.0)


@pytest.mark.parametrize("motion", ["steering", "tracks"])
def test_noise_is_in_what_is_reported_and_not_in_where_the_vehicle_goes(motion: str) -> None:
    runs = []
    for noise in (0.0, 1.0):
        env = LineWorldEnv(motion=motion, noise=noise)
        env.reset(seed=1)
        runs.append([env.step(action) for action in ACTIONS.astype(np.float32)])
    for (exact, *_, clean), (noisy, *_, info) in zip(*runs, strict=True):
        np.testing.assert_array_equal(clean["true_pose"], info["true_pose"])
        np.testing.assert_array_equal(exact[motion], info["true_controls"])
        assert not np.array_equal(noisy[motion], info["true_controls"])


def test_the_reported_controls_lead_along_the_true_way_by_equation_5() -> None:
    env = LineWorldEnv(noise=0.0, start=[4.0, 5.0, -2.0])
    env.reset(seed=0)
    x, y, heading = 0.0, 0.0, 0.0  # in the frame of the start
    for action in ACTIONS.astype(np.float32):
        shown, *_, info = env.step(action)
        V, a = shown["steering"]
        x += 0.025 * V * np.cos(heading + a)
        y += 0.025 * V * np.sin(heading + a)
        heading += 0.025 * V * np.sin(a) / 4.0
    np.testing.assert_allclose(info["true_pose"], [x, y, float(wrap(heading))], atol=1e-9)
    np.testing.assert_array_equal(info["start_pose"], [4.0, 5.0, -2.0])


def test_lines_are_seen_from_where_the_vehicle_is() -> None:
    env = LineWorldEnv(noise=0.0, observe_every=1)
    env.reset(seed=0)
    for action in ACTIONS.astype(np.float32):
        shown, *_, info = env.step(action)
        rows = shown["lines"][shown["lines"].any(axis=1)].reshape(-1, 2)
        ends = rows[:, :1] * np.stack([np.cos(rows[:, 1]), np.sin(rows[:, 1])], axis=-1)
        pose = compose(info["start_pose"], info["true_pose"])
        world = compose(pose, np.column_stack([ends, np.zeros(len(ends))]))[:, :2]
        truth = info["true_visible"].reshape(-1, 2)
        truth = truth[truth.any(axis=1)]
        away = np.linalg.norm(world[:, None] - truth, axis=-1)
        assert away.min(axis=1).max() < 1e-9 and len(world)


def test_leaving_a_sensor_out_changes_no_others_noise() -> None:
    every = LineWorldEnv(sensors=["steering", "lines", "lidar"])
    shown = [env.reset(seed=5)[0] for env in (every, LineWorldEnv(sensors=["lidar"]))]
    np.testing.assert_array_equal(shown[0]["lidar"], shown[1]["lidar"])
    assert set(shown[1]) == {"stamp", "lidar", "lidar_stamp"}


@pytest.mark.parametrize("observer", ["bisection", "point-by-point"])
def test_every_observer_shows_nearly_the_same_lines(observer: str) -> None:
    exact = LineWorldEnv(noise=0.0, world="yan-over-range").reset(seed=0)[0]["lines"]
    seen = LineWorldEnv(noise=0.0, world="yan-over-range", observer=observer).reset(seed=0)[0]
    np.testing.assert_allclose(seen["lines"], exact, atol=0.11)
    assert not np.array_equal(seen["lines"], exact)


def test_an_episode_goes_on_bit_for_bit_from_a_saved_moment() -> None:
    env = LineWorldEnv(motion="tracks", sensors=["tracks", "lines", "lidar"])
    env.reset(seed=2)
    for action in ACTIONS[:13]:
        env.step(action)
    saved = pickle.loads(pickle.dumps(env.save_state()))

    def rest(of: LineWorldEnv) -> list[Any]:
        steps = [of.step(action) for action in ACTIONS[13:40]]
        told = [part for shown, *_, info in steps for part in (shown, info)]
        told.extend(of.reset())  # the next episode's seed is kept as well
        return [value for part in told for value in part.values()]

    twin = LineWorldEnv(motion="tracks", sensors=["tracks", "lines", "lidar"])
    twin.restore_state(saved)
    for here, there in zip(rest(env), rest(twin), strict=True):
        np.testing.assert_array_equal(here, there)


def test_an_episode_is_truncated_after_max_steps() -> None:
    env = LineWorldEnv(max_steps=3)
    env.reset(seed=0)
    assert [env.step(np.ones(2))[2:4] for _ in range(3)] == [(False, False)] * 2 + [(False, True)]


def test_the_rig_is_the_papers_unless_something_else_is_said() -> None:
    rig = LineWorldEnv().rig
    assert rig.dt == 0.025 and rig.tracks is None and rig.steering is not None
    assert (rig.steering.wheelbase, rig.steering.max_speed) == (4.0, 3.0)
    changed = LineWorldEnv(rig={"steering.wheelbase": 2.0}, range_max=12.0, n_beams=90).rig
    assert changed.steering is not None and changed.steering.wheelbase == 2.0
    assert changed.lidar is not None and changed.lidar.n_beams == 90
    assert changed.lidar.range_max == 12.0


def test_the_picture_shows_more_of_the_way_with_every_step() -> None:
    env = gym.make("grouser/LineWorld-v0", render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    for action in np.ones((100, 2), dtype=np.float32):
        env.step(action)
    second = env.render()
    assert isinstance(first, np.ndarray) and isinstance(second, np.ndarray)
    assert first.shape == (480, 640, 3) and first.dtype == np.uint8
    blue = [(frame == (0, 114, 178)).all(axis=2).sum() for frame in (first, second)]
    assert blue[1] > blue[0] + 20


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"motion": "wheels"}, "no motion is named 'wheels'; known: steering, tracks"),
        ({"sensors": ["tracks"]}, "motion='steering' has no sensor 'tracks'.*it has: steering, l"),
        ({"observer": "bisektion"}, "did you mean 'bisection'"),
        ({"observe_every": 0}, "observe_every must be a whole number above zero"),
        ({"max_steps": 1.5}, "max_steps must be a whole number above zero"),
        ({"n_beams": 0}, "n_beams must be a whole number above zero"),
        ({"render_mode": "human"}, "no render mode is named 'human'; known: None, rgb_array"),
        (
            {"rig": {"steering": None}},
            "motion='steering' has steering, line_sensor, lidar and no t",
        ),
        ({"rig": {"line_sensor.max_lines": 3}}, "at least the number of segments, 4, got 3"),
        ({"rig": {"wheelbase": 3}}, "the rig has no 'wheelbase' to override"),
        ({"dt": 0.0}, "Rig.dt must be positive"),
        ({"speed": -1.0}, "max_speed must be positive"),
    ],
)
def test_what_cannot_be_made_is_refused_with_words(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        LineWorldEnv(**options)


def test_what_cannot_be_done_is_refused_with_words() -> None:
    env = LineWorldEnv()
    for call in (lambda: env.step(np.ones(2)), env.render, env.save_state):
        with pytest.raises(ResetNeeded, match="call reset"):
            call()
    with pytest.raises(ValueError, match="reset takes no options"):
        env.reset(options={"world": 1})
    env.reset(seed=0)
    with pytest.raises(ValueError, match="two finite numbers"):
        env.step(np.array([np.nan, 0.0]))
