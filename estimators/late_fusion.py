"""A fusion whose images come late or seldom, and poses for now all the same."""

from collections import deque

import numpy as np

from grouser.estimators.base import SAME_TIME, Observation, PoseEstimate
from grouser.estimators.coupled_odometry import CoupledOdometry
from grouser.estimators.late_pictures import LatePictures


class LateFusion:
    """What comes without its images waits for them; from there the fusion is led on to now.

    So nothing is measured against a time that it is not of, and every reading counts once. An image
    is of the time that `left_stamp` or `right_stamp` says; where an observation has no such stamps,
    all of it is of now, and nothing is done here. Who waits too long goes without images.
    """

    def __init__(self, fusion: CoupledOdometry) -> None:
        self._fusion = fusion
        self._eyes = fusion.eyes
        self._pictures = LatePictures(self._eyes)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero with the first observation, all of which is of now."""
        estimate = self._fusion.reset(observation, rng=rng)
        self._pictures.reset(observation)
        self._waiting: deque[Observation] = deque()
        return estimate

    def update(self, observation: Observation) -> PoseEstimate:
        """Take what came, and tell the pose at the observation's stamp."""
        if not self._pictures.may_be_late(observation):
            return self._fusion.update(observation)
        self._pictures.take(observation)
        self._waiting.append(
            {key: np.array(value) for key, value in observation.items() if not self._of_image(key)}
        )
        estimate = self._take_pair()
        self._give_up_until(float(observation["stamp"][0]) - _LONGEST_WAIT)
        if estimate is None or self._waiting:
            return self._fusion.led_on(self._waiting)
        return estimate

    def _take_pair(self) -> PoseEstimate | None:
        """The fusion's estimate at the time of the newest pair; None without one.

        One whose time no observation has belongs to the next.
        """
        pair_at = self._pictures.newest()
        if pair_at is None:
            return None
        images = self._pictures.pop(pair_at)
        while (observation := self._waiting.popleft())["stamp"][0] < pair_at - SAME_TIME:
            self._fusion.pass_by(observation)
        return self._fusion.update({**observation, **images})

    def _give_up_until(self, time: float) -> None:
        """What is that old goes without images."""
        while self._waiting and self._waiting[0]["stamp"][0] < time:
            observation = self._waiting.popleft()
            self._pictures.skip(float(observation["stamp"][0]))
            self._fusion.update(observation)

    def _of_image(self, key: str) -> bool:
        return key.removesuffix("_stamp") in self._eyes


_LONGEST_WAIT = 1.0  # s
