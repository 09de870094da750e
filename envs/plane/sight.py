"""What shows a vehicle the segments: ends of their visible parts, a scan, or a point of each; every
few steps."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.plane.scan import cast
from grouser.envs.sensors.delivery import LONGEST_STAMP
from grouser.envs.sensors.line_observer import LineObserver
from grouser.geometry import Array, wrap
from grouser.rig import Lidar, Rig
from grouser.rig_motion import LineSensor

Reading = dict[str, NDArray[Any]]

SIGHTS = ("lines", "lidar", "points")
"""Keys of the observation that show the segments."""

SHORTEST = 1.0
"""m; of a line of which less is visible, the line sensor says nothing (SPEC 2.3)."""

_FARTHEST = 1e6  # m

_TAIL = 10.0
"""Sigmas of noise that a space has room for; no draw is beyond them."""


class Sight:
    """Looks at the segments at every so many-th step, the first one included.

    Where it does not look at every step, each key has its `<key>_stamp` (1,) beside it: when it
    last looked, s. In between, `lines` and `points` show none, for what was seen adds up to a map
    as increments do to a way, and `lidar` its last scan.

    Args:
        rig: the vehicle's calibration.
        keys: of SIGHTS, what to look with.
        observer: what finds the visible parts.
        every: steps from one look to the next.
    """

    def __init__(
        self, rig: Rig, keys: Sequence[str], *, observer: LineObserver, every: int
    ) -> None:
        assert rig.line_sensor is not None and rig.lidar is not None
        self._sensor, self._lidar, self._dt = rig.line_sensor, rig.lidar, rig.dt
        self._keys = [key for key in SIGHTS if key in keys]
        self._observer, self._every = observer, every
        self._shown: Reading = {}
        self._stamp = 0.0
        self.visible: Array = np.empty((0, 4))
        """(n, 4) both ends of what was truly visible of each segment when it last looked, m, in
        the world; NaN where nothing was."""

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        """Key and bounded space of all that it shows."""
        every = {
            "lines": _space_of_lines(self._sensor),
            "lidar": _space_of_scans(self._lidar),
            "points": _space_of_points(self._sensor),
        }
        shown = {key: every[key] for key in self._keys}
        stamp = spaces.Box(0.0, LONGEST_STAMP, (1,), np.float64)
        return shown if self._every == 1 else shown | {f"{key}_stamp": stamp for key in shown}

    def look(
        self, step: int, segments: Array, pose: Array, rngs: Mapping[str, np.random.Generator]
    ) -> Reading:
        """What is shown after a step, from a true pose (3,), with a generator for each key."""
        if step % self._every == 0:
            self._stamp = step * self._dt
            self.visible = visible_parts(self._observer, segments, pose, self._sensor.range_max)
            self._shown = {key: self._measure(key, segments, pose, rngs[key]) for key in self._keys}
        else:
            fleeting = {"lines", "points"} & set(self._shown)
            self._shown |= {key: np.zeros_like(self._shown[key]) for key in fleeting}
        readings = {key: value.copy() for key, value in self._shown.items()}
        if self._every == 1:
            return readings
        return readings | {f"{key}_stamp": np.array([self._stamp]) for key in readings}

    def save(self) -> Any:
        """What it showed last."""
        return copy.deepcopy((self._shown, self._stamp, self.visible))

    def restore(self, saved: Any) -> None:
        """Go on from there."""
        self._shown, self._stamp, self.visible = copy.deepcopy(saved)

    def _measure(
        self, key: str, segments: Array, pose: Array, rng: np.random.Generator
    ) -> NDArray[Any]:
        if key == "lines":
            return seen_ends(self._sensor, self.visible, pose, rng)
        if key == "points":
            return seen_feet(self._sensor, segments, self.visible, pose, rng)
        return scanned(self._lidar, segments, pose, rng)


def visible_parts(observer: LineObserver, segments: Array, pose: Array, reach: float) -> Array:
    """(n, 4) both ends of what is within reach of each segment, m, world; NaN where nothing is."""
    t = observer.observe(segments, pose[:2], reach)
    a, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    return np.hstack([a + t[:, :1] * along, a + t[:, 1:] * along])


def seen_ends(
    sensor: LineSensor, visible: Array, pose: Array, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(max_lines, 4) the line sensor's reading: range and bearing of each visible part's ends.

    Each row goes counter-clockwise, and so do the rows, as the sensor measures it: what noise
    turns round is reported turned round. Parts of less than SHORTEST are left out.
    """
    # For every segment, seen or not: what is visible here changes no later noise.
    noise = rng.standard_normal((len(visible), 2, 2)) * [sensor.sigma_range, sensor.sigma_bearing]
    long = _long(visible)
    away = visible[long].reshape(-1, 2, 2) - pose[:2]
    ranges = np.maximum(np.hypot(away[..., 0], away[..., 1]) + noise[long, :, 0], 0.0)
    angles = np.arctan2(away[..., 1], away[..., 0]) - pose[2]
    bearings = wrap(angles + noise[long, :, 1])
    clockwise = wrap(bearings[:, 1] - bearings[:, 0]) < 0
    for polar in (ranges, bearings):
        polar[clockwise] = polar[clockwise, ::-1]
    rows = np.stack([ranges, bearings], axis=-1).reshape(-1, 4)[np.argsort(bearings[:, 0])]
    told = np.zeros((sensor.max_lines, 4))
    told[: len(rows)] = rows
    return told


def seen_feet(
    sensor: LineSensor, segments: Array, visible: Array, pose: Array, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(max_lines, 2) range and bearing of a point of each line of which the sensor sees a part: the
    foot of the world's origin on it, which is how paper 2 names a line (its section 1.3).

    The foot need not be visible itself. The rows are sorted by bearing.
    """
    noise = rng.standard_normal((len(visible), 2)) * [sensor.sigma_range, sensor.sigma_bearing]
    long = _long(visible)
    a, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    t = -np.sum(a * along, axis=1) / np.sum(along**2, axis=1)
    away = (a + t[:, None] * along - pose[:2])[long]
    ranges = np.maximum(np.hypot(away[:, 0], away[:, 1]) + noise[long, 0], 0.0)
    bearings = wrap(np.arctan2(away[:, 1], away[:, 0]) - pose[2] + noise[long, 1])
    told = np.zeros((sensor.max_lines, 2))
    told[: len(ranges)] = np.column_stack([ranges, bearings])[np.argsort(bearings)]
    return told


def _long(visible: Array) -> NDArray[np.bool_]:
    """(n,) of which parts (n, 4) enough is visible."""
    length = np.hypot(visible[:, 2] - visible[:, 0], visible[:, 3] - visible[:, 1])
    return np.asarray(length >= SHORTEST)


def scanned(
    lidar: Lidar, segments: Array, pose: Array, rng: np.random.Generator
) -> NDArray[np.float32]:
    """(n_beams,) m: exact ranges along slightly wrong bearings, then noise; `range_max` where a
    beam meets nothing. The lidar is at the vehicle's origin."""
    bearing_noise, range_noise = rng.standard_normal((2, lidar.n_beams))
    directions = pose[2] + lidar.bearings + lidar.sigma_bearing * bearing_noise
    ranges = cast(segments, pose[:2], directions, lidar.range_max)
    told = ranges + lidar.sigma_range * range_noise
    within = np.clip(told, lidar.range_min, lidar.range_max)
    return np.asarray(within, dtype=np.float32)


def _space_of_lines(sensor: LineSensor) -> spaces.Box:
    # An end at the limit of the range may be rounded to beyond it.
    longest = sensor.range_max * (1 + 1e-9) + _TAIL * sensor.sigma_range
    high = np.tile([longest, np.pi, longest, np.pi], (sensor.max_lines, 1))
    low = np.tile([0.0, -np.pi, 0.0, -np.pi], (sensor.max_lines, 1))
    return spaces.Box(low, high, dtype=np.float64)


def _space_of_points(sensor: LineSensor) -> spaces.Box:
    high = np.tile([_FARTHEST, np.pi], (sensor.max_lines, 1))
    return spaces.Box(high * [0.0, -1.0], high, dtype=np.float64)


def _space_of_scans(lidar: Lidar) -> spaces.Box:
    return spaces.Box(lidar.range_min, lidar.range_max, (lidar.n_beams,), np.float32)
