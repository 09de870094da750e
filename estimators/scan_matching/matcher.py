"""One scan laid over others: where it was taken, how well that is known, and how well it fits."""

from dataclasses import dataclass, field, replace
from math import radians

import numpy as np

from grouser.estimators.scan_matching.alignment import Alignment, AlignmentOptions, align
from grouser.estimators.scan_matching.reference import Reference
from grouser.estimators.scan_matching.search import SearchOptions, score, search, value
from grouser.estimators.scan_matching.surface import Surface
from grouser.geometry import Array, wrap
from grouser.kernels import announce


@dataclass(frozen=True, slots=True)
class MatchOptions:
    """How a scan is matched."""

    search: SearchOptions = field(default_factory=SearchOptions)
    """Around the guess"""
    alignment: AlignmentOptions = field(default_factory=AlignmentOptions)
    """From the best pose of the search on"""


@dataclass(frozen=True, slots=True, eq=False)
class ScanMatch:
    """A scan's pose among the scans of a reference."""

    pose: Array
    """(3,) x, y [m], heading [rad] of the scan in the frame of the reference: the most likely one,
    given the guess."""
    covariance: Array
    """(3, 3) of the pose, as if the poses of the reference were known: that of the guess where the
    scan tells nothing, as along a corridor."""
    information: Array
    """(3, 3) what the scan alone tells, without the guess: zero in directions in which it tells
    nothing. The inverse of its covariance where that exists. From the Hessian at the solution, the
    spread of the distances and their correlation from beam to beam."""
    by_scan: Array
    """(k, 3, 3) the parts of `information` that come from each scan of the reference."""
    scan_share: float
    """How much of the noise that `information` counts is the scan's own: half over one scan, more
    over several, whose noise is averaged."""
    score: float
    """Mean over the scan's points of exp(-d^2 / 2 sigma^2), d to the nearest point of the
    reference, sigma that of the search: 1 where all points lie on the reference, 0 where none
    does."""
    inlier_ratio: float
    """Share of the scan's points that are near a point of the reference: on a line, or, in clutter,
    in both coordinates; near is where Cauchy's weight is at least a half."""
    eigenvalue_ratio: float
    """Least over largest eigenvalue of the information on the position, the heading known, less
    what noise in the normals makes of it: 1 where the scan is held alike in all directions, 0 in a
    corridor (or where nothing fits)."""
    sigma: float
    """Of a distance between a point and its surface, m"""
    doubt: Array
    """(3,) from `pose` to where the alignment alone would lay the scan, while fewer of its points
    fit there; zero where search and alignment agree."""


class ScanMatcher:
    """Correlative search around a guess, then point-to-line alignment."""

    def __init__(self, options: MatchOptions | None = None) -> None:
        """options: left out, as `MatchOptions` has them."""
        self._options = options or MatchOptions()
        announce()

    def match(
        self,
        surface: Surface,
        reference: Reference,
        guess: Array,
        guess_covariance: Array | None = None,
    ) -> ScanMatch:
        """Find the pose of a scan.

        Args:
            surface: what the scan shows, in its own frame; see `surface_of`.
            reference: what it is laid over; see `make_reference`.
            guess: (3,) where the scan is expected, in the frame of the reference.
            guess_covariance: (3, 3) of that, positive definite. Left out, the guess is as uncertain
                as the search is wide.
        """
        options = self._options
        if guess_covariance is None:
            width = options.search
            guess_covariance = np.diag([width.position, width.position, width.heading]) ** 2
        prior = np.asarray(np.linalg.inv(guess_covariance), dtype=np.float64)
        guess = np.array(guess, dtype=np.float64)
        aligned, prior, doubt = self._aligned(surface, reference, guess, prior)
        share = _scan_share(aligned.by_scan)
        by_scan = share * aligned.by_scan
        information = by_scan.sum(axis=0)
        information = (information + information.T) / 2
        covariance = np.linalg.inv(information + prior)
        n = max(len(surface.points), 1)
        least, most = np.linalg.eigvalsh(aligned.directions)
        return ScanMatch(
            pose=aligned.pose,
            covariance=(covariance + covariance.T) / 2,
            information=information,
            by_scan=by_scan,
            scan_share=share,
            score=score(surface.points, reference.field, aligned.pose, options.search.sigma),
            inlier_ratio=aligned.inliers / n,
            eigenvalue_ratio=float(max(least, 0.0) / most) if most > 0 else 0.0,
            sigma=aligned.sigma,
            doubt=doubt,
        )

    def _aligned(
        self, surface: Surface, reference: Reference, guess: Array, prior: Array
    ) -> tuple[Alignment, Array, Array]:
        """The alignment, the information of the guess that it went by, and the doubt of it."""
        searching, aligning = self._options.search, self._options.alignment
        start = search(surface.points, reference.field, guess, prior, searching)
        aligned = align(surface, reference, start, guess, prior, aligning)
        if between_steps(start, aligned.pose, searching):
            return aligned, prior, np.zeros(3)
        least = value(surface.points, reference.field, start, guess, prior, searching)
        least -= _LURED
        if value(surface.points, reference.field, aligned.pose, guess, prior, searching) >= least:
            return aligned, prior, np.zeros(3)
        # Points that were taken for others' surfaces lured it away from where more of them fit:
        # from there again, held, and with near pairs only.
        near = replace(aligning, first_radius=aligning.last_radius)
        again = align(surface, reference, start, start, _HELD, near)
        if value(surface.points, reference.field, again.pose, guess, prior, searching) < least:
            again = replace(again, pose=start)
        doubt = aligned.pose - again.pose
        doubt[2] = wrap(doubt[2])
        return again, _HELD, doubt


def between_steps(start: Array, end: Array, options: SearchOptions) -> bool:
    """Whether an alignment went no farther than the search's steps, between which its cells cannot
    tell what fits better."""
    x, y, turn = np.abs(end - start)
    return bool(
        max(x, y) <= options.fine_position and abs(wrap(turn)) <= _TURN_STEPS * options.fine_heading
    )


def _scan_share(by_scan: Array) -> float:
    """1 / (1 + 1 / n) where n scans of a reference (k, 3, 3) tell alike: each as noisy as the one
    that is laid over them."""
    told = np.maximum(np.trace(by_scan, axis1=1, axis2=2), 0.0)
    alone = float(told @ told) / max(float(told.sum()) ** 2, _NOTHING)
    return 1 / (1 + alone)


_NOTHING = 1e-12
_TURN_STEPS = 2.5
"""Of the search, that noise in the cells may be worth"""
_LURED = 1.0
"""Log-likelihood that an alignment may lose against the search"""
_HELD = np.linalg.inv(np.diag([0.05, 0.05, radians(0.7)]) ** 2)
"""Information of a pose of the search: its steps are the finest"""
