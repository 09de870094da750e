"""Images that come late or seldom, or one eye before the other, and poses for now all the same."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from grouser.estimators.base import SAME_TIME, Observation, PoseEstimate, Status, stamp_of
from grouser.estimators.late_pictures import LatePictures
from grouser.estimators.visual.fusion import Accumulated, nothing_yet
from grouser.estimators.visual.prediction import MotionPredictor
from grouser.geometry import Array, between, compose, compose_jacobians, exp, lift, log

_STEREO = ("left", "right")
_ROUNDING = 1e-6  # of a share


class TimelyOdometry(Protocol):
    """Visual odometry of images that belong to now."""

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero with the first pair."""

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next pair and the motion since the last one."""

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors as estimated (n,), and their covariance (n, n)."""


@dataclass(frozen=True, slots=True)
class _Stretch:
    """What the tracks said of a stretch of time."""

    start: float
    end: float
    increments: Array

    def within(self, start: float, end: float) -> Array:
        """(2,) the share of it that belongs to a stretch of time."""
        overlap = min(self.end, end) - max(self.start, start)
        share = overlap / (self.end - self.start)
        return self.increments if share > 1 - _ROUNDING else share * self.increments


class LateImages:
    """The odometry sees each pair once, with the tracks up to then; from there they lead to now.

    An image is of the time that `left_stamp` or `right_stamp` says, and a pair are two of the same
    time. Where an observation has no such stamps, all of it is of now, and nothing is done here.
    A pair older than `lost_after` supports nothing any more.
    """

    def __init__(
        self,
        odometry: TimelyOdometry,
        make_predictor: Callable[[Observation], MotionPredictor],
        *,
        dt: float,
        lost_after: float,
        eyes: tuple[str, ...] = _STEREO,
    ) -> None:
        """eyes: the images that belong together."""
        self._odometry, self._make_predictor = odometry, make_predictor
        self._dt, self._lost_after = dt, lost_after
        self._eyes, self._pictures = eyes, LatePictures(eyes)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero with the first pair, which is of now."""
        now = float(observation["stamp"][0])
        self._seen_at = self._tracked_to = now
        self._seen = self._odometry.reset(observation, rng=rng)
        self._pictures.reset(observation)
        self._stretches: list[_Stretch] = []
        self._first = {k: np.array(v) for k, v in observation.items() if k not in self._eyes}
        self._step: Array | None = None
        return self._seen

    def update(self, observation: Observation) -> PoseEstimate:
        """Take what came, and tell the pose at the observation's stamp."""
        if not (self._pictures.may_be_late(observation) or "tracks_stamp" in observation):
            return self._odometry.update(observation)
        self._take(observation)
        # A pair is looked at when the motion up to it is known too.
        until = self._tracked_to if "tracks" in self._first else np.inf
        pair_at = self._pictures.newest(until=until)
        if pair_at is not None:
            self._look(pair_at)
        now = float(observation["stamp"][0])
        return self._carried(now, self._ahead(now))

    def _take(self, observation: Observation) -> None:
        """Note what is new, by the time that it is of."""
        self._pictures.take(observation)
        if "tracks" in self._first:
            end = stamp_of("tracks", observation)
            if end > self._tracked_to + SAME_TIME:
                increments = np.array(observation["tracks"], dtype=np.float64)
                self._stretches.append(_Stretch(self._tracked_to, end, increments))
                self._tracked_to = end

    def _look(self, pair_at: float) -> None:
        shown = self._pictures.pop(pair_at)
        if "tracks" in self._first:
            shown["tracks"] = np.sum(self._between(self._seen_at, pair_at), axis=0)
        before, steps = self._seen, max(round((pair_at - self._seen_at) / self._dt), 1)
        self._seen = self._odometry.update({**shown, "stamp": np.array([pair_at])})
        self._step = exp(log(between(before.pose, self._seen.pose)) / steps)
        self._seen_at = pair_at
        self._stretches = [s for s in self._stretches if s.end > pair_at + SAME_TIME]

    def _between(self, start: float, end: float) -> list[Array]:
        """The tracks' increments from one time to another, stretch by stretch."""
        inside = [
            s for s in self._stretches if s.end > start + SAME_TIME and s.start < end - SAME_TIME
        ]
        return [s.within(start, end) for s in inside]

    def _ahead(self, now: float) -> Accumulated:
        """The way since the pair: by the tracks as far as they are known, then as it was."""
        predictor = self._make_predictor(self._first)
        predictor.learn(self._step)
        biases, _ = self._odometry.of_predictor()
        way, known_to = nothing_yet(predictor.errors), self._seen_at
        for increments in self._between(self._seen_at, now):
            increment = predictor.predict({**self._first, "tracks": increments}, biases)
            predictor.learn(increment.pose)
            way, known_to = way.then(increment), self._tracked_to
        silence = {**self._first, "tracks": np.full(2, np.nan)}
        for _ in range(round((now - known_to) / self._dt)):
            way = way.then(predictor.predict(silence, biases))
        return way

    def _carried(self, now: float, way: Accumulated) -> PoseEstimate:
        seen = self._seen
        _, covariance_of_biases = self._odometry.of_predictor()
        F, G = compose_jacobians(seen.pose, way.pose)
        Q = way.covariance + way.by_biases @ covariance_of_biases @ way.by_biases.T
        P = F @ seen.covariance @ F.T + G @ Q @ G.T
        return replace(
            seen,
            pose=compose(seen.pose, way.pose),
            covariance=(P + P.T) / 2,
            pose_3d=None if seen.pose_3d is None else seen.pose_3d @ lift(way.pose),
            status=self._status(now, way),
            stamp=now,
            diagnostics={**seen.diagnostics, "image_age": now - self._seen_at},
        )

    def _status(self, now: float, way: Accumulated) -> Status:
        if now - self._seen_at <= self._lost_after + SAME_TIME:
            return self._seen.status
        return Status.COASTING if way.measured else Status.LOST
