"""The last keyframe scans at the poses found for them: what the next scan is laid over."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from grouser.checks import require_positive, require_whole
from grouser.estimators.scan_matching.reference import Reference, make_reference
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, between


@dataclass(frozen=True, slots=True)
class LocalMapOptions:
    """Which scans are kept, and for how long."""

    scans: int = 25
    """Keyframes that are kept, at most,"""
    length: float = 20.0
    """and how much of the way they go back, m."""
    step: float = 0.5
    """Way after which a scan becomes a keyframe, m,"""
    turn: float = 0.35
    """or turn, rad."""

    def __post_init__(self) -> None:
        require_whole(self, "scans")
        require_positive(self, "length", "step", "turn")


@dataclass(frozen=True, slots=True)
class _Keyframe:
    surface: Surface
    pose: Array
    way: float
    """m from the first one"""


class LocalMap:
    """Keyframes, the oldest first."""

    def __init__(self, options: LocalMapOptions) -> None:
        self._options = options
        self._kept: deque[_Keyframe] = deque()
        self._reference: Reference | None = None

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def reference(self) -> Reference:
        """All of them; there must be one."""
        if self._reference is None:
            self._reference = make_reference([k.surface for k in self._kept], self.poses)
        return self._reference

    @property
    def poses(self) -> Array:
        """(k, 3)"""
        return np.array([keyframe.pose for keyframe in self._kept]).reshape(-1, 3)

    def wants(self, pose: Array) -> bool:
        """Whether a scan at this pose (3,) is far enough from the last keyframe."""
        if not self._kept:
            return True
        x, y, turn = between(self._kept[-1].pose, pose)
        return bool(np.hypot(x, y) >= self._options.step or abs(turn) >= self._options.turn)

    def add(self, surface: Surface, pose: Array) -> int:
        """Keep a scan (in its own frame) that was taken at the pose (3,); how many old ones go."""
        way = 0.0
        if self._kept:
            last = self._kept[-1]
            way = last.way + float(np.hypot(*(pose - last.pose)[:2]))
        self._kept.append(_Keyframe(surface, pose.copy(), way))
        self._reference, gone = None, 0
        while len(self._kept) > self._options.scans or (
            len(self._kept) > 1 and way - self._kept[0].way > self._options.length
        ):
            self._kept.popleft()
            gone += 1
        return gone
