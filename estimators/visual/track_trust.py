"""How noisy the tracks are taken to be in the dark: as vision found them before.

What tracks bring themselves (encoders, shoes that stretch) is new in every frame, and seen in every
frame's turn. What the ground adds, slip, goes on for a while, so that it shows in full only over
the whole way since a keyframe. In the dark nobody sees the ground change: so the tracks' own noise
goes on as it was, and slip is taken to be as large as anybody expected, or larger where it was.
"""

from grouser.estimators.visual.single_pose import wrapped
from grouser.estimators.visual.variance_factor import Innovation, VarianceFactor
from grouser.geometry import Array


class TrackTrust:
    """Learns from innovations what the prediction's white noise must be multiplied by."""

    def __init__(self) -> None:
        self._of_ways = VarianceFactor(prior=2.0, memory=50.0)
        self._of_frames = VarianceFactor(prior=3.0, memory=100.0)
        self._last: tuple[int, float, float, float] | None = None

    def in_the_dark(self, covariance: Array, of_tracks: Array) -> Array:
        """(3, 3) noise of what was predicted with a covariance, of which a part is the tracks'."""
        slip = max(self._of_ways.value, 1.0)
        return slip * (covariance - of_tracks) + self._of_frames.value * of_tracks

    def watch(self, frames: int, turn_error: float, predicted: float, measured: float) -> None:
        """Take note of how far vision's turn since the keyframe is off the tracks' (rad), with the
        variances of both, so many frames after it."""
        if self._last is not None and frames == self._last[0] + 1:
            _, error, predicted_before, measured_before = self._last
            self._of_frames.learn_one(
                float(wrapped(turn_error - error)) ** 2,
                predicted - predicted_before,
                measured + measured_before,
            )
        self._last = frames, turn_error, predicted, measured

    def end_way(self, seen: Innovation | None) -> None:
        """The frame becomes the keyframe, with what vision said against the whole way to it."""
        self._last = None
        if seen is not None:
            self._of_ways.learn(seen)
