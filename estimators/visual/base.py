"""What visual odometry asks of a front end; where its features come from is the leaf's affair."""

from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

from grouser.estimators.base import Observation
from grouser.estimators.visual.matching import Matches, Prediction
from grouser.estimators.visual.structure import OffsetEvidence
from grouser.geometry import Array


class Features(Protocol):
    """What any frame, and any keyframe, lets others know."""

    @property
    def points(self) -> Array:
        """(n, 3) u, v, d [px], calibrated."""


FrameT = TypeVar("FrameT", bound=Features)
KeyframeT = TypeVar("KeyframeT", bound=Features)


class Frontend(ABC, Generic[FrameT, KeyframeT]):
    """Turns observations into frames of features, and finds features of one in another."""

    @property
    @abstractmethod
    def expected_noise(self) -> Array:
        """(6,) variances of u, v, d [px^2] in the keyframe and in the frame, of a good match."""

    @abstractmethod
    def reset(self) -> None:
        """Forget what earlier observations led to."""

    @abstractmethod
    def extract(self, observation: Observation) -> FrameT:
        """The features that an observation shows.

        Raises:
            ValueError: it is not what the rig promises.
        """

    @abstractmethod
    def make_keyframe(self, frame: FrameT) -> KeyframeT:
        """The frame as one that later frames are compared with."""

    @abstractmethod
    def match(self, keyframe: KeyframeT, frame: FrameT, prediction: Prediction) -> Matches:
        """The keyframe's features found again, sought where its points are predicted."""

    @abstractmethod
    def learn(self, matches: Matches, evidence: OffsetEvidence) -> None:
        """What the structure of matched points told of the cameras."""
