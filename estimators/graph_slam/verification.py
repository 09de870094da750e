"""Whether a scan was taken where an old one was: how well it fits there, and where else it fits."""

from dataclasses import dataclass
from math import radians

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.graph_slam.wide_search import Window, best_fits
from grouser.estimators.scan_matching.matcher import MatchOptions, ScanMatch, ScanMatcher
from grouser.estimators.scan_matching.reference import Reference
from grouser.estimators.scan_matching.search import SearchOptions
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, wrap


@dataclass(frozen=True, slots=True)
class FitOptions:
    """When a scan fits (SPEC 2.6)."""

    score: float = 0.5
    """Mean over its points of exp(-d^2 / 2 sigma^2), at least."""
    inliers: float = 0.55
    """Share of its points that lie on surfaces, at least."""
    eigenvalue_ratio: float = 0.05
    """Least over largest eigenvalue of the normals' outer products: below, it may slide along."""
    rival: float = 0.85
    """Score of another place that it fits, over that of the best, from which on it is in doubt."""
    gate: float = 11.3
    """Squared correction of the graph over its covariance, at most: 99 % of right ones."""
    tracking: float = 0.6
    """Correction by a closure that follows others, at most, m."""
    tracking_heading: float = radians(5.0)
    """Of its heading, rad."""

    def __post_init__(self) -> None:
        require_positive(
            self,
            "score",
            "inliers",
            "eigenvalue_ratio",
            "rival",
            "gate",
            "tracking",
            "tracking_heading",
        )


class Verifier:
    """Lays a scan over old ones."""

    def __init__(self, options: FitOptions) -> None:
        self._options = options
        self._refining = ScanMatcher(_searching(_REFINED))
        self._tracking = ScanMatcher(_searching(_TRACKED))

    def search(
        self, surface: Surface, reference: Reference, guess: Array, covariance: Array
    ) -> ScanMatch | None:
        """The one place that the scan fits, within what the graph leaves open.

        Args:
            guess: (3,) of the scan in the frame of the reference, as the graph has it, with its
                covariance (3, 3).
        """
        sigma, sigma_heading = widths(covariance)
        window = Window(
            float(np.clip(3 * sigma, *_POSITIONS)), float(np.clip(3 * sigma_heading, *_HEADINGS))
        )
        starts, shares = best_fits(surface.points, reference.field, guess, window, _PLACES)
        matches = [
            self._refining.match(surface, reference, start, _AROUND)
            for start, share in zip(starts, shares, strict=True)
            if share > _WORTH * shares[0]
        ]
        if not matches:
            return None
        best = max(matches, key=lambda match: match.score)
        off = _off(best.pose, guess)
        improbable = off @ np.linalg.solve(covariance + _ROUGHLY, off) > self._options.gate
        rivalled = any(self._rivals(match, best) for match in matches)
        return None if improbable or rivalled or not self._fits(best) else best

    def track(self, surface: Surface, reference: Reference, guess: Array) -> ScanMatch | None:
        """The place near the guess (3,) where the scan fits, the loop being closed already."""
        match = self._tracking.match(surface, reference, guess, _NEAR)
        off = _off(match.pose, guess)
        near = np.hypot(off[0], off[1]) <= self._options.tracking
        near = near and abs(off[2]) <= self._options.tracking_heading
        return match if near and self._fits(match) else None

    def _fits(self, match: ScanMatch) -> bool:
        o = self._options
        return (
            match.score >= o.score
            and match.inlier_ratio >= o.inliers
            and match.eigenvalue_ratio >= o.eigenvalue_ratio
        )

    def _rivals(self, match: ScanMatch, best: ScanMatch) -> bool:
        """Whether it is another place, and fits almost as well."""
        off = _off(match.pose, best.pose)
        elsewhere = np.hypot(off[0], off[1]) > _ELSEWHERE[0] or abs(off[2]) > _ELSEWHERE[1]
        return bool(elsewhere) and match.score > self._options.rival * best.score


def widths(covariance: Array) -> tuple[float, float]:
    """One sigma of a pose: of its position in the direction that is known least [m], of its heading
    [rad]."""
    return (
        float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1])),
        float(np.sqrt(covariance[2, 2])),
    )


def _searching(reach: tuple[float, float]) -> MatchOptions:
    return MatchOptions(search=SearchOptions(position=reach[0], heading=reach[1]))


def _off(pose: Array, guess: Array) -> Array:
    off = pose - guess
    off[2] = wrap(off[2])
    return off


_POSITIONS, _HEADINGS = (0.6, 4.0), (radians(5.0), radians(20.0))
"""m, rad: what is searched at least and at most, to either side"""
_PLACES, _WORTH = 3, 0.8
"""Places that are looked at closely, and their fit over that of the best"""
_REFINED = (0.2, radians(2.0))
"""m, rad about each of them"""
_AROUND = np.diag([0.5, 0.5, 0.1]) ** 2
_TRACKED = (0.3, radians(4.0))
_NEAR = np.diag([0.2, 0.2, radians(3.0)]) ** 2
_ROUGHLY = np.diag([0.05, 0.05, 0.01]) ** 2
"""m^2, rad^2 that a match may be off"""
_ELSEWHERE = (0.4, radians(5.0))
"""m, rad from which on two places are not the same"""
