"""Loops: a scan laid over those of long ago, and closed when several agree, or not at all.

A wrong closure is worse than none (SPEC 2.6): a place that looks alike turns the whole map. So a
scan must fit in one place only among those that the graph leaves open (`verification`), and several
along the way must say the same.
"""

from dataclasses import dataclass
from math import radians

import numpy as np

from grouser.checks import require_positive, require_whole
from grouser.estimators.graph_slam.keyframes import Keyframes
from grouser.estimators.graph_slam.pose_graph import PoseGraph
from grouser.estimators.graph_slam.verification import FitOptions, Verifier, widths
from grouser.estimators.scan_matching.matcher import ScanMatch
from grouser.estimators.scan_matching.reference import Reference
from grouser.geometry import Array, between, compose, wrap


@dataclass(frozen=True, slots=True)
class LoopOptions:
    """When a loop is closed (SPEC 2.6)."""

    least_way: float = 15.0
    """Driven since the scan that is met again, m."""
    near: float = 4.0
    """Between the two, beside what the graph leaves open, m."""
    overlap: float = 0.5
    """Share of what the lidar sees in one heading that it sees in the other, too, at least, beside
    what the graph leaves open: a lidar that sees all around may be turned any way."""
    agreeing: int = 3
    """Scans that must agree before a loop is closed,"""
    stretch: float = 2.0
    """along a way of so many sigmas of what the graph leaves open: twins are passed by before."""
    agreement: float = 0.4
    """They may differ by so much, m,"""
    agreement_heading: float = radians(5.0)
    """and their headings, rad."""

    def __post_init__(self) -> None:
        require_positive(
            self, "least_way", "near", "overlap", "stretch", "agreement", "agreement_heading"
        )
        require_whole(self, "agreeing")
        if self.overlap >= 1:
            raise ValueError(f"LoopOptions.overlap must be below 1, got {self.overlap}")


@dataclass(frozen=True, slots=True)
class Closure:
    """Keyframe `new` as seen from keyframe `old`."""

    old: int
    new: int
    pose: Array
    """(3,)"""
    information: Array
    """(3, 3)"""


class LoopCloser:
    """Looks for loops, one keyframe after another."""

    def __init__(self, loops: LoopOptions, fit: FitOptions, field_of_view: float) -> None:
        """field_of_view: rad, of the lidar."""
        self._options, self._field_of_view = loops, field_of_view
        self._verifier = Verifier(fit)
        self._pending: list[Closure] = []
        self._misses = _LOST
        self._references: dict[int, Reference] = {}

    def look(self, graph: PoseGraph, keyframes: Keyframes) -> list[Closure]:
        """Closures of the latest keyframe, and of those before it that it makes sure of."""
        old = self._candidate(graph, keyframes)
        if self._misses < _LOST:
            return self._track(graph, keyframes, old)
        if old is None:
            return []
        covariance = graph.relative_covariance(old)
        surface = keyframes.surfaces[-1]
        guess = between(graph.poses[old], graph.poses[-1])
        reference = self._reference(graph, keyframes, old)
        match = self._verifier.search(surface, reference, guess, covariance)
        if match is None:
            return []
        return self._agreed(graph, keyframes, _closure(old, graph, match), covariance)

    def forget_references(self) -> None:
        """The graph has moved."""
        self._references.clear()

    def _candidate(self, graph: PoseGraph, keyframes: Keyframes) -> int | None:
        """The old keyframe from which most of what is seen now may have been seen."""
        o, n = self._options, keyframes.before(self._options.least_way)
        if n == 0:
            return None
        seen = between(graph.poses[:n], graph.poses[-1])
        distance, turn = np.hypot(seen[:, 0], seen[:, 1]), np.abs(wrap(seen[:, 2]))
        sigma, sigma_heading = widths(graph.covariance)
        overlap = shared_view(turn, self._field_of_view)
        near = (distance < o.near) & (overlap >= o.overlap)
        if not near.any():
            near = distance < o.near + _OPEN * sigma
            least_turn = np.maximum(turn - _OPEN * sigma_heading, 0.0)
            near &= shared_view(least_turn, self._field_of_view) >= o.overlap
        if not near.any():
            return None
        unlike = (1 - overlap) / (1 - o.overlap)
        return int(np.argmin(np.where(near, distance / o.near + unlike, np.inf)))

    def _track(self, graph: PoseGraph, keyframes: Keyframes, old: int | None) -> list[Closure]:
        """The loop is closed: what follows fits the old scans, too, or it ends."""
        match = None
        if old is not None:
            guess = between(graph.poses[old], graph.poses[-1])
            reference = self._reference(graph, keyframes, old)
            match = self._verifier.track(keyframes.surfaces[-1], reference, guess)
        self._misses = self._misses + 1 if match is None else 0
        return [] if match is None or old is None else [_closure(old, graph, match)]

    def _reference(self, graph: PoseGraph, keyframes: Keyframes, old: int) -> Reference:
        """The scans about an old one, in its frame."""
        if old not in self._references:
            if len(self._references) >= _KEPT:
                self.forget_references()
            which = keyframes.around(old, _ABOUT, keyframes.before(self._options.least_way))
            reference = keyframes.reference(which, graph.poses, graph.poses[old])
            self._references[old] = reference
        return self._references[old]

    def _agreed(
        self, graph: PoseGraph, keyframes: Keyframes, closure: Closure, covariance: Array
    ) -> list[Closure]:
        """It and those before it that agree, if they are enough."""
        now = keyframes.way[closure.new]
        stretch = self._options.stretch * widths(covariance)[0]
        self._pending = [
            c for c in self._pending if now - keyframes.way[c.new] <= max(_PENDING, 3 * stretch)
        ]
        agreeing = [c for c in self._pending if self._agree(graph, c, closure)]
        self._pending.append(closure)
        if len(agreeing) + 1 < self._options.agreeing:
            return []
        if now - keyframes.way[agreeing[0].new] < stretch:
            return []
        self._pending, self._misses = [], 0
        return [*agreeing, closure]

    def _agree(self, graph: PoseGraph, one: Closure, other: Closure) -> bool:
        """Whether the motion between both, in the old map, is that of the new stretch."""
        poses = graph.poses
        expected = compose(
            compose(poses[one.old], one.pose), between(poses[one.new], poses[other.new])
        )
        off = between(expected, compose(poses[other.old], other.pose))
        return bool(
            np.hypot(off[0], off[1]) < self._options.agreement
            and abs(off[2]) < self._options.agreement_heading
        )


def shared_view(turn: Array, field_of_view: float) -> Array:
    """Share of a field of view [rad] seen in both of two headings, (n,) that are 0 .. pi apart."""
    f = min(field_of_view, 2 * np.pi)
    return np.asarray((np.maximum(f - turn, 0.0) + np.maximum(turn + f - 2 * np.pi, 0.0)) / f)


def _closure(old: int, graph: PoseGraph, match: ScanMatch) -> Closure:
    covariance = np.linalg.inv(match.information + _NOTHING) + _OLD_SCANS
    return Closure(old, len(graph) - 1, match.pose, np.linalg.inv(covariance))


_LOST = 3
"""Keyframes in a row that do not fit the old scans, after which a loop must be closed anew"""
_OPEN = 2.0
"""Sigmas of the graph"""
_ABOUT = 5.0
"""m of the way before and after an old keyframe, whose scans are laid together"""
_KEPT = 20
"""References"""
_PENDING = 8.0
"""m of the way that a closure waits for others that agree"""
_OLD_SCANS = np.diag([0.02, 0.02, radians(0.3)]) ** 2
"""m^2, rad^2: how well the scans that are laid together are known from each other"""
_NOTHING = 1e-2 * np.eye(3)
"""m^-2, rad^-2: information where a scan tells nothing"""
