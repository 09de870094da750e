"""`grouser/GoalNav-v0`: reach a goal among obstacles by a pose that is only estimated."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from numbers import Integral
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from grouser.agents.goal_score import (
    COLLISION,
    MISSED,
    RUNNING,
    SUCCESS,
    SUCCESS_RADIUS,
    TIMEOUT,
    GoalScore,
    Reward,
)
from grouser.agents.goal_view import GoalView, believed_goal, known_policy_sensors
from grouser.agents.other_moments import OtherMoments
from grouser.agents.pose_delay import PoseDelay
from grouser.checks import did_you_mean
from grouser.envs.sensors.suite import DEFAULT_SENSORS, SENSORS
from grouser.envs.simulation.world import World
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators import registry
from grouser.estimators.base import PoseEstimate, Status
from grouser.estimators.wrapper import EstimatedPose
from grouser.geometry import Array, between
from grouser.rig import Rig

STOPS = ("belief", "agent", "arrival")
"""What ends the drive to a goal."""

SHUFFLED = "shuffled"
"""Instead of the estimate's covariance, that of another moment."""

_BELIEVED_RADIUS = SUCCESS_RADIUS / 2  # m; room for error before a stop at the edge is a miss


class GoalNavEnv(gym.Env[dict[str, Any], NDArray[np.float32]]):
    """Drive the tracked robot to goals that are given in the frame of the start.

    The observation: `beams`, the lidar by sectors; `goal` (3,), its distance and the cosine and
    sine of its bearing as the ESTIMATED pose has them; `last_action` (2,); where asked for,
    `pose_covariance` (6,), the upper triangle of the estimate's, row by row; and images.

    The action is that of the robot, left and right track speed in [-1, 1]; with stop="agent" a
    third number stops where it is positive.

    Reward and end are by the truth. A stop within 0.3 m of the last goal (success), one elsewhere
    (missed) and a collision terminate the episode, the time limit truncates it; after a stop at a
    goal before the last the next one is shown. `info` holds the robot's truth, `pose_status` of the
    newest estimate, and: `outcome` ("running", "reached", "success", "missed", "collision",
    "timeout"), `is_success`, `goals_reached`, and in m `distance_to_goal` and
    `believed_distance_to_goal` (straight, to the goal that the robot drove to in this step),
    `path_length` and `shortest_path`; `progress` is the share of the shortest way that was gained.

    Args:
        estimator: a registered name; see `grouser.estimators.names()`.
        estimator_options: keyword arguments of that estimator.
        world: kind of world, of `world_names()`, one that has goals. The depot's obstacles are all
            in sight of the lidar; in the yard some are lower.
        goals: how many goals to reach, one after another.
        pose_latency: how late estimates arrive, s of simulated time.
        stop: what ends the drive: "belief", the robot believes itself within 0.15 m of the goal and
            is not lost; "agent", a third action; "arrival", it truly is within 0.3 m.
        policy_sensors: what the policy sees, of lidar, left and right.
        beams: number of the lidar's sectors.
        normalize: beams in [0, 1] and the distance in units of 10 m, instead of metres.
        covariance: show the estimate's covariance; with "shuffled" that of a random moment of other
            episodes, which is as often as large but tells nothing of this one (a control).
        time_limit: for each goal, s.
        reward: weights of `grouser.agents.goal_score.Reward` by name.
        robot: further keyword arguments of `TrackedRobotEnv`, but sensors: those are what the
            estimator and the policy read.
        render_mode: None, "rgb_array" or "human".

    Raises:
        ValueError: an unknown name, a value out of range, or a robot without what is read.
    """

    metadata: dict[str, Any] = TrackedRobotEnv.metadata

    def __init__(
        self,
        *,
        estimator: str = "dead-reckoning",
        estimator_options: Mapping[str, Any] | None = None,
        world: str = "depot",
        goals: int = 1,
        pose_latency: float = 0.0,
        stop: str = "belief",
        policy_sensors: Iterable[str] = ("lidar",),
        beams: int = 36,
        normalize: bool = True,
        covariance: bool | str = False,
        time_limit: float = 100.0,
        reward: Mapping[str, float] | None = None,
        robot: Mapping[str, Any] | None = None,
        render_mode: str | None = None,
    ) -> None:
        if stop not in STOPS:
            hint = did_you_mean(stop, STOPS)
            raise ValueError(f"no stop is named {stop!r}; {hint}known: {', '.join(STOPS)}")
        if not 0 < time_limit < float("inf"):
            raise ValueError(f"time_limit must be positive and finite, s, got {time_limit!r}")
        self._stop, self._n_goals = stop, _checked_goals(goals)
        self._time_limit = time_limit * self._n_goals
        self._reward = _reward(reward or {})
        self._delay = PoseDelay(pose_latency)
        seen = known_policy_sensors(policy_sensors)
        self._others: OtherMoments | None = None
        if _checked_covariance(covariance) == SHUFFLED:
            rehearsal = partial(
                GoalNavEnv,
                estimator=estimator,
                estimator_options=estimator_options,
                world=world,
                goals=goals,
                pose_latency=pose_latency,
                policy_sensors=(),
                time_limit=time_limit,
                robot=robot,
            )
            self._others = OtherMoments(rehearsal)
        self.render_mode = render_mode
        self._robot = TrackedRobotEnv(
            **_checked_robot(robot or {}),
            world=world,
            sensors=_sensors_read(estimator, estimator_options or {}, seen),
            render_mode=render_mode,
        )
        self.rig: Rig = self._robot.rig
        shown = self._robot.observation_space
        self._estimated = EstimatedPose(self._robot, estimator, **(estimator_options or {}))
        self._view = GoalView(
            self.rig,
            shown,
            sensors=seen,
            beams=beams,
            normalize=normalize,
            covariance=covariance is not False,
        )
        self.observation_space: spaces.Dict = self._view.space
        n_actions = 3 if stop == "agent" else 2
        self.action_space = spaces.Box(-1.0, 1.0, (n_actions,), np.float32)
        self._score: GoalScore | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """A new world and some of its goals, with the robot at rest at its start.

        Raises:
            ValueError: options were given; there are none. Or the world has too few goals.
        """
        super().reset(seed=seed)
        shown, info = self._estimated.reset(seed=seed, options=options)
        self._score = GoalScore(self.world, self._choose_goals())
        self.goal = self._score.goal
        self._n_steps, self._last_action = 0, np.zeros(2)
        self._believed = self._delay.reset(self._estimated.estimate)
        if self._others:
            self._others.reset(anew=seed is not None, rng=self.np_random)
        return self._observe(shown), self._say(info, RUNNING)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Drive for one step, or stop.

        Raises:
            ValueError: the action is not as many finite numbers as the action space has.
            ResetNeeded: `reset` was not called yet.
        """
        score = self._require_reset()
        tracks, says_stop = self._read(action)
        shown, _, _, _, info = self._estimated.step(tracks)
        self._n_steps += 1
        self._last_action = np.minimum(np.maximum(tracks, -1.0), 1.0)
        self._believed = self._delay.arrived(self._estimated.estimate, self._time)
        progress = score.advance(info)
        outcome = score.judge(
            info,
            stopped=self._has_stopped(score, says_stop),
            out_of_time=self._time >= self._time_limit - self.rig.dt / 2,
        )
        said = self._say(info, outcome)
        self.goal = score.goal
        ended = outcome in (SUCCESS, MISSED, COLLISION)
        reward = self._reward.of(progress, outcome)
        return self._observe(shown), reward, ended, outcome == TIMEOUT, said

    @property
    def world(self) -> World:
        """What stands where: for planners and drawings, not for policies."""
        return self._robot.world

    @property
    def believed(self) -> PoseEstimate:
        """The last estimate that has arrived: what a driver may know of the pose.

        Raises:
            ResetNeeded: `reset` was not called yet.
        """
        self._require_reset()
        return self._believed

    @property
    def sensors(self) -> tuple[str, ...]:
        """What the robot's environment was asked for."""
        return tuple(key for key in SENSORS if key in self._robot.observation_space.keys())

    def render(self) -> NDArray[np.uint8] | None:
        """A view from behind, as the robot's environment renders it."""
        return self._robot.render()

    def close(self) -> None:
        """Free what the robot's environment holds."""
        self._robot.close()

    @property
    def _time(self) -> float:
        return self._n_steps * self.rig.dt

    def _choose_goals(self) -> Array:
        """(k, 2) m, some of the world's goals in some order, in the frame of the start."""
        world, n = self.world, self._n_goals
        if len(world.goals) < n:
            raise ValueError(
                f"the world {world.name!r} has {len(world.goals)} goals, fewer than goals={n}; "
                "ask for fewer, or choose another world"
            )
        chosen = self.np_random.choice(len(world.goals), size=n, replace=False)
        headed = np.column_stack([world.goals[chosen], np.zeros(n)])
        return np.asarray(between(world.start, headed)[:, :2])

    def _read(self, action: NDArray[np.float32]) -> tuple[Array, bool]:
        values = np.asarray(action, dtype=np.float64)
        if values.shape != self.action_space.shape or not np.isfinite(values).all():
            raise ValueError(
                f"an action is {self.action_space.shape} finite numbers: left and right track "
                f'speed, and with stop="agent" whether to stop; got {action!r}'
            )
        return values[:2], len(values) > 2 and bool(values[2] > 0)

    def _has_stopped(self, score: GoalScore, says_stop: bool) -> bool:
        if self._stop == "agent":
            return says_stop
        if self._stop == "arrival":
            return score.distance <= SUCCESS_RADIUS
        # A lost robot cannot tell whether it arrived.
        return self._believed.status is not Status.LOST and (
            self._believed_distance() <= _BELIEVED_RADIUS
        )

    def _believed_distance(self) -> float:
        return believed_goal(self._believed.pose, self.goal)[0]

    def _observe(self, shown: dict[str, Any]) -> dict[str, Any]:
        told = self._believed
        if self._others:
            told = replace(told, covariance=self._others.instead_of(told.covariance))
        return dict(self._view.of(shown, told, self.goal, self._last_action))

    def _say(self, info: dict[str, Any], outcome: str) -> dict[str, Any]:
        return {**info, **self._require_reset().said(outcome, self._believed_distance())}

    def _require_reset(self) -> GoalScore:
        if self._score is None:
            raise ResetNeeded("call reset() before step()")
        return self._score


def _sensors_read(
    estimator: str, options: Mapping[str, Any], policy: tuple[str, ...]
) -> tuple[str, ...]:
    """Keys that an estimator or a policy reads; of what an estimator may do without, those that
    the robot has by default."""
    optional = registry.optional_keys(estimator, options) & set(DEFAULT_SENSORS)
    read = registry.estimator_class(estimator).requires | optional | set(policy)
    return tuple(key for key in SENSORS if key in read)


def _checked_robot(robot: Mapping[str, Any]) -> dict[str, Any]:
    taken = sorted({"sensors", "world", "render_mode"} & set(robot))
    if taken:
        raise ValueError(
            f"robot= may not set {taken}: sensors follow from estimator and policy_sensors, world "
            "and render_mode are arguments of their own"
        )
    return dict(robot)


def _checked_covariance(covariance: bool | str) -> bool | str:
    if covariance not in (False, True, SHUFFLED):
        raise ValueError(f'covariance must be True, False or "{SHUFFLED}", got {covariance!r}')
    return covariance


def _checked_goals(goals: int) -> int:
    if not (isinstance(goals, Integral) and goals >= 1):
        raise ValueError(f"goals must be a whole number of 1 or more, got {goals!r}")
    return int(goals)


def _reward(weights: Mapping[str, float]) -> Reward:
    known = Reward.__dataclass_fields__
    unknown = sorted(set(weights) - set(known))
    if unknown:
        raise ValueError(f"no reward is named {unknown[0]!r}; known: {', '.join(known)}")
    return Reward(**weights)
