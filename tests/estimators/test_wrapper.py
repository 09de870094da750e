"""EstimatedPose: what it adds, what it hides, and that it disturbs nothing."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import grouser.estimators as estimators
from grouser import geometry
from grouser.estimators import EstimatedPose, PoseEstimate, PoseEstimator, Status, registry
from grouser.estimators.track_motion import arc_pose, track_increment
from grouser.geometry import Array
from grouser.rig import Rig, TrackGeometry

WIDTH = 0.5
TOY = "toy/Robot-v0"
Info = dict[str, Any]


class ToyRobot(gym.Env[dict[str, Any], Any]):
    """Tracks that slip at random, and nothing else: the smallest robot that drifts."""

    metadata = {"render_modes": []}
    render_mode = None

    def __init__(self) -> None:
        self.rig = Rig(dt=0.1, tracks=TrackGeometry(0.4, 0.08, WIDTH))
        self.action_space = spaces.Box(-1.0, 1.0, (2,))
        self.observation_space = spaces.Dict(
            {
                "tracks": spaces.Box(-1.0, 1.0, (2,), dtype=np.float64),
                "stamp": spaces.Box(0.0, 1e9, (1,), dtype=np.float64),
            }
        )

    def reset(
        self, *, seed: int | None = None, options: Info | None = None
    ) -> tuple[dict[str, Any], Info]:
        super().reset(seed=seed)
        self._pose, self._steps = np.zeros(3), 0
        return self._shown(np.zeros(2))

    def step(self, action: Array) -> tuple[dict[str, Any], float, bool, bool, Info]:
        du = 0.05 * np.asarray(action, dtype=np.float64)
        slipped = du * (1 - 0.1 * self.np_random.random(2))
        self._pose = geometry.compose(self._pose, arc_pose(*track_increment(slipped, WIDTH)))
        self._steps += 1
        observation, info = self._shown(du)
        return observation, 0.0, False, False, info

    def _shown(self, du: Array) -> tuple[dict[str, Any], Info]:
        observation = {"tracks": du.copy(), "stamp": np.array([0.1 * self._steps])}
        truth = {"true_pose": self._pose.copy(), "true_pose_3d": geometry.lift(self._pose)}
        return observation, truth


class Dice(PoseEstimator):
    """Guesses: shows which random numbers an estimator gets, and what it is shown."""

    requires = frozenset({"tracks", "stamp"})

    def __init__(self, rig: Rig, *, sides: int = 6) -> None:
        self.sides = sides
        self.seen: list[set[str]] = []

    def reset(self, observation: Any, *, rng: np.random.Generator) -> PoseEstimate:
        self._rng = rng
        return self.update(observation)

    def update(self, observation: Any) -> PoseEstimate:
        self.seen.append(set(observation))
        pose = np.append(self._rng.integers(self.sides, size=2), 0.0)
        return PoseEstimate(pose, np.eye(3), Status.COASTING, float(observation["stamp"][0]))


class Peeking(Dice):
    requires = frozenset({"true_pose"})


class NeedsLidar(Dice):
    requires = frozenset({"lidar", "stamp"})


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registry", dict(registry._registry))
    toy = EnvSpec(TOY, entry_point=f"{__name__}:ToyRobot")
    monkeypatch.setitem(gym.registry, TOY, toy)
    for name, kind in (("dice", "Dice"), ("peeking", "Peeking"), ("needs-lidar", "NeedsLidar")):
        estimators.register(name, f"{__name__}:{kind}")


def drive(env: gym.Env[Any, Any], *, seed: int | None, steps: int = 30) -> list[dict[str, Any]]:
    """The observations of one episode under fixed actions."""
    observations = [env.reset(seed=seed)[0]]
    for angle in np.linspace(0, 6, steps):
        action = np.array([np.cos(angle), 0.5], dtype=np.float32)
        observations.append(env.step(action)[0])
    return observations


def same_bits(a: list[dict[str, Any]], b: list[dict[str, Any]]) -> bool:
    return all(
        x.keys() == y.keys() and all(np.array_equal(x[key], y[key]) for key in x)
        for x, y in zip(a, b, strict=True)
    )


def test_it_adds_pose_and_covariance_to_observation_and_space() -> None:
    env = EstimatedPose(ToyRobot(), "dead-reckoning")
    observation, info = env.reset(seed=0)
    assert set(observation) == {"tracks", "stamp", "pose", "pose_covariance"}
    assert observation in env.observation_space
    observation, _, _, _, info = env.step(np.array([0.5, 1.0], dtype=np.float32))
    assert observation in env.observation_space
    assert observation["pose"].dtype == observation["pose_covariance"].dtype == np.float64
    assert info["pose_status"] == "coasting"
    assert np.array_equal(env.estimate.pose, observation["pose"])


def test_the_pose_is_that_of_the_estimator_by_itself() -> None:
    env = EstimatedPose(ToyRobot(), "dead-reckoning", track_noise=0.1)
    shown = drive(env, seed=3)
    alone = estimators.make("dead-reckoning", ToyRobot().rig, track_noise=0.1)
    poses = [alone.reset(shown[0], rng=np.random.default_rng(0))]
    poses += [alone.update(observation) for observation in shown[1:]]
    for observation, estimate in zip(shown, poses, strict=True):
        assert np.array_equal(observation["pose"], estimate.pose)
        assert np.array_equal(observation["pose_covariance"], estimate.covariance)


def test_ground_truth_is_the_true_pose() -> None:
    env = EstimatedPose(ToyRobot(), "ground-truth")
    env.reset(seed=0)
    for _ in range(20):
        observation, _, _, _, info = env.step(np.array([1.0, 0.2], dtype=np.float32))
        assert np.allclose(observation["pose"], info["true_pose"], atol=1e-15)
        assert info["pose_status"] == "tracking"


def test_the_inner_environment_keeps_its_bits() -> None:
    bare = drive(ToyRobot(), seed=5)
    wrapped = drive(EstimatedPose(ToyRobot(), "dice"), seed=5)
    inner = [{key: seen[key] for key in ("tracks", "stamp")} for seen in wrapped]
    assert same_bits(bare, inner)


@pytest.mark.parametrize("seed", [0, 7])
def test_the_same_seed_gives_the_same_bits_and_another_seed_others(seed: int) -> None:
    env = EstimatedPose(ToyRobot(), "dice")
    first = drive(env, seed=seed)
    assert same_bits(first, drive(env, seed=seed))
    assert same_bits(first, drive(EstimatedPose(ToyRobot(), "dice"), seed=seed))
    assert not same_bits(first, drive(env, seed=seed + 1))


def test_a_reset_without_seed_goes_on_deterministically() -> None:
    episodes = []
    for _ in range(2):
        env = EstimatedPose(ToyRobot(), "dice")
        episodes.append([drive(env, seed=0), drive(env, seed=None), drive(env, seed=None)])
    assert all(same_bits(a, b) for a, b in zip(*episodes, strict=True))
    assert not same_bits(episodes[0][1], episodes[0][2])


def test_an_environment_never_seeded_can_be_repeated_from_the_seed_it_drew() -> None:
    env = EstimatedPose(ToyRobot(), "dice")
    first = drive(env, seed=None)
    drawn = env.unwrapped.np_random_seed
    assert same_bits(first, drive(EstimatedPose(ToyRobot(), "dice"), seed=drawn))


class GarbageInfo(gym.Wrapper[Any, Any, Any, Any]):
    """Says false things in info."""

    def reset(self, **arguments: Any) -> tuple[Any, Info]:
        return self.env.reset(**arguments)[0], self.garbage()

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, Info]:
        return (*self.env.step(action)[:4], self.garbage())

    def garbage(self) -> Info:
        return {"true_pose": "nowhere", "true_pose_3d": None, "tracks": np.full(2, 9.0)}


@pytest.mark.parametrize("name", ["dead-reckoning", "dice"])
def test_what_info_says_changes_no_estimate(name: str) -> None:
    honest = drive(EstimatedPose(ToyRobot(), name), seed=1)
    garbled = drive(EstimatedPose(GarbageInfo(ToyRobot()), name), seed=1)
    assert same_bits(honest, garbled)


def test_an_estimator_sees_only_what_it_declares() -> None:
    env = EstimatedPose(ToyRobot(), "dice")
    drive(env, seed=0, steps=3)
    assert isinstance(env.estimator, Dice)
    assert env.estimator.seen == [{"tracks", "stamp"}] * 4


def test_the_truth_is_for_ground_truth_alone() -> None:
    with pytest.raises(
        ValueError, match=r"'peeking' asks for the truth .* none but 'ground-truth'"
    ):
        EstimatedPose(ToyRobot(), "peeking")


def test_ground_truth_without_a_truth_to_tell_says_so() -> None:
    class Silent(GarbageInfo):
        def garbage(self) -> Info:
            return {"frame": 3}

    env = EstimatedPose(Silent(ToyRobot()), "ground-truth")
    with pytest.raises(
        ValueError, match=r"requires \['true_pose', 'true_pose_3d'\] in info, which"
    ):
        env.reset(seed=0)


def test_missing_sensors_are_refused_at_construction_naming_both_sets() -> None:
    words = (
        r"NeedsLidar requires observations \['lidar', 'stamp'\], but the environment gives "
        r"\['stamp', 'tracks'\], without \['lidar'\]; make the environment with sensors="
    )
    with pytest.raises(ValueError, match=words):
        EstimatedPose(ToyRobot(), "needs-lidar")


def test_a_rig_without_the_parts_needed_is_refused_at_construction() -> None:
    env = ToyRobot()
    env.rig = Rig(dt=0.1)
    with pytest.raises(ValueError, match=r"needs rig\.tracks"):
        EstimatedPose(env, "dead-reckoning")


def test_an_environment_without_rig_is_refused() -> None:
    env = gym.wrappers.FilterObservation(ToyRobot(), ["tracks"])
    del env.unwrapped.rig  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"has no `rig` of type grouser\.rig\.Rig"):
        EstimatedPose(env, "dice")


def test_a_flattened_observation_is_refused() -> None:
    with pytest.raises(ValueError, match="needs an observation space of type Dict, got Box"):
        EstimatedPose(gym.wrappers.FlattenObservation(ToyRobot()), "dice")


def test_two_estimates_in_one_observation_are_refused() -> None:
    with pytest.raises(ValueError, match=r"already has \['pose', 'pose_covariance'\]"):
        EstimatedPose(EstimatedPose(ToyRobot(), "dice"), "dice")


def test_a_misspelt_estimator_gets_a_suggestion() -> None:
    with pytest.raises(ValueError, match="did you mean 'dead-reckoning'"):
        EstimatedPose(ToyRobot(), "dead-reckonin")


def test_there_is_no_estimate_before_reset() -> None:
    with pytest.raises(gym.error.ResetNeeded, match="before the first"):
        _ = EstimatedPose(ToyRobot(), "dice").estimate


def test_alone_or_in_a_vector_it_estimates_the_same_bits() -> None:
    seeds: list[int | None] = [0, 1, 2]
    several = gym.vector.SyncVectorEnv([lambda: EstimatedPose(ToyRobot(), "dice")] * len(seeds))
    shown, _ = several.reset(seed=seeds)
    stepped = several.step(np.ones((len(seeds), 2), dtype=np.float32))[0]
    for index, seed in enumerate(seeds):
        env = EstimatedPose(ToyRobot(), "dice")
        alone = [env.reset(seed=seed)[0], env.step(np.ones(2, dtype=np.float32))[0]]
        member = [{key: value[index] for key, value in all_.items()} for all_ in (shown, stepped)]
        assert same_bits(alone, member)


def test_the_spec_rebuilds_environment_and_estimator() -> None:
    env = EstimatedPose(gym.make(TOY), "dice", sides=1000)
    assert env.spec is not None
    for spec in (env.spec, EnvSpec.from_json(env.spec.to_json())):
        twin = gym.make(spec)
        assert same_bits(drive(env, seed=2), drive(twin, seed=2))
        assert twin.get_wrapper_attr("estimator").sides == 1000


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")  # it is a wrapper
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["dead-reckoning", "ground-truth", "dice"])
def test_gymnasiums_checker_passes_without_a_warning(name: str) -> None:
    check_env(EstimatedPose(gym.make(TOY), name))
