"""What visual odometry asks of the filter that fuses prediction and vision."""

from typing import Protocol

from grouser.estimators.visual.fusion import Accumulated, FilterState, Fused, RelativePose
from grouser.geometry import Array


class PoseFilter(Protocol):
    """As `RelativeFilter` does it; the state is that at the keyframe until the next `commit`."""

    def of_predictor(self) -> tuple[Array, Array]:
        """The predictor's constant errors (n,) as estimated, and their covariance (n, n)."""

    def coast(self, predicted: Accumulated, start: FilterState | None = None) -> Fused:
        """Prediction alone, from a state, by default that at the keyframe."""

    def doubt(
        self, predicted: Accumulated, anchor: Array, start: FilterState | None = None
    ) -> Fused:
        """The same, where the robot may as well have stayed at the anchor (3,)."""

    def follow(self, measured: RelativePose, frames: int) -> Fused:
        """Measurement alone, after so many frames."""

    def fuse(self, predicted: Accumulated, measured: RelativePose) -> Fused:
        """Both."""

    def believe(self, fused: Fused, measured: RelativePose, frames: int) -> None:
        """This fusion, so many frames after the keyframe, is right."""

    def relative(self, fused: Fused, start: FilterState | None = None) -> Array:
        """(3,) the fused pose as seen from a state, by default that at the keyframe."""

    def commit(self, fused: Fused) -> None:
        """The current frame becomes the keyframe."""

    def offset(self) -> tuple[float, float]:
        """The disparity offset at the keyframe and its sigma, px."""

    def observe_offset(self, offset: float, sigma: float) -> None:
        """The disparity offset was measured at the keyframe, px."""

    def doubt_offset(self, sigma: float) -> None:
        """What is believed of the disparity offset is less sure by so much, px."""
