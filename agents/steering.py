"""Paper 2's driver: steers a vehicle through waypoints, one after another (SPEC 2.0)."""

import math
from collections.abc import Sequence

import numpy as np

from grouser.estimators.base import PoseEstimate, Status
from grouser.geometry import Array, wrap
from grouser.rig import Rig

ARRIVAL_RADIUS = 1.0
"""m"""


class SteeringDriver:
    """Turns the wheel towards the next waypoint at the largest rate; call it with each pose for
    the action of that step: the speed and the angle of the front wheel over their maximum."""

    def __init__(
        self,
        rig: Rig,
        waypoints: Sequence[tuple[float, float]] | Array,
        *,
        arrival_radius: float = ARRIVAL_RADIUS,
    ) -> None:
        """Drive the vehicle of `rig` through `waypoints` [m, in the frame of the start].

        Raises:
            ValueError: the rig does not steer, there is no waypoint or one that is not two finite
                numbers, or the radius is not positive.
        """
        if rig.steering is None:
            raise ValueError(
                "to steer, a vehicle needs rig.steering, and this rig has None; make the "
                'environment with motion="steering"'
            )
        self.waypoints = np.array(waypoints, dtype=np.float64)
        of_points = self.waypoints.ndim == 2 and self.waypoints.shape[1] == 2
        if not (of_points and len(self.waypoints) and np.isfinite(self.waypoints).all()):
            raise ValueError(f"waypoints must be x, y [m], finite, at least one, got {waypoints}")
        if not arrival_radius > 0:
            raise ValueError(f"arrival_radius must be positive, m, got {arrival_radius}")
        self._steering, self._dt, self._radius = rig.steering, rig.dt, arrival_radius
        self._target, self._angle = 0, 0.0

    def __call__(self, estimate: PoseEstimate) -> Array | None:
        """The action (2,), or None when the last waypoint is reached as far as is known.

        A vehicle that is LOST stands still, for it might drive into anything.
        """
        if estimate.status is Status.LOST:
            return np.array([0.0, self._angle / self._steering.max_angle])
        x, y, heading = estimate.pose.tolist()
        to_x, to_y = (self.waypoints[self._target] - (x, y)).tolist()
        if math.hypot(to_x, to_y) < self._radius:
            self._target += 1
            if self._target == len(self.waypoints):
                return None
            to_x, to_y = (self.waypoints[self._target] - (x, y)).tolist()
        self._turn_towards(math.atan2(to_y, to_x) - heading)
        return np.array([1.0, self._angle / self._steering.max_angle])

    def _turn_towards(self, bearing: float) -> None:
        """g += clip(wrap(bearing - g), -+ rate T), then within the largest angle."""
        s = self._steering
        most = s.max_angle_rate * self._dt
        turn = float(wrap(bearing - self._angle))
        angle = self._angle + min(max(turn, -most), most)
        self._angle = min(max(angle, -s.max_angle), s.max_angle)
