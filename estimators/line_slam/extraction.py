"""Lines from a lidar scan, with covariances: SPEC 2.5."""

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.checks import require_not_negative, require_positive, require_whole
from grouser.estimators.line_slam.break_points import beginning, break_points
from grouser.estimators.line_slam.lines import places_along, points_on, tangents, turned_over
from grouser.estimators.line_slam.measurements import LineMeasurements, no_lines
from grouser.estimators.line_slam.merge import Fits, fit_and_merge, largest_chi2, strays
from grouser.estimators.line_slam.open_ends import open_ends
from grouser.estimators.line_slam.returns import Returns, Spacing, returns_of, rolled
from grouser.estimators.line_slam.scan import Scan, ScanReader
from grouser.estimators.line_slam.settle import settle_corners
from grouser.estimators.line_slam.split import runs_between, split_at_corners
from grouser.geometry import Array, wrap
from grouser.rig import Lidar

_SETTLING = 2
"""Times that corners are moved and lines fitted anew: a line with a wrong return tells well whose
return it is, one without any tells it best."""


@dataclass(frozen=True, slots=True)
class ExtractionOptions:
    """What counts as a line, and how noisy a scan is at least."""

    min_beams: int = 6
    """Returns that a line has at least."""
    min_length: float = 0.6
    """m"""
    sigma_range: float = 0.002
    """Of a range, m, where the rig says less: walls are not as straight as lines."""
    sigma_bearing: float = 0.0002
    """Of a bearing, rad, where the rig says less."""
    flattest: float = radians(10.0)
    """rad between beam and surface; where it may be less, neighbouring returns are not joined."""
    missing_beams: int = 2
    """Between two returns of the same surface."""
    split_sigmas: float = 3.5
    """How far a return may be from the chord of a piece, in sigmas of its noise,"""
    split_floor: float = 0.02
    """and beside that, m."""
    merge_gate: float = 9.21
    """Squared difference of neighbours over its covariance, below which they are one: chi-square of
    2 degrees of freedom at 99 %."""
    range_margin: float = 0.5
    """What is nearer to the lidar's range_max than this may have returned nothing, m."""

    def __post_init__(self) -> None:
        require_whole(self, "min_beams", "missing_beams")
        require_positive(self, "sigma_range", "sigma_bearing", "flattest", "merge_gate")
        require_not_negative(self, "min_length", "split_sigmas", "split_floor", "range_margin")


class LineExtractor:
    """Sees lines in the scans of one lidar."""

    def __init__(self, lidar: Lidar, options: ExtractionOptions | None = None) -> None:
        self._options = options = options or ExtractionOptions()
        self._reader = ScanReader(lidar)
        self._reach = lidar.range_max - options.range_margin
        seam = 2 * np.pi - (lidar.n_beams - 1) * self._reader.increment
        self._spacing = Spacing(
            n_beams=lidar.n_beams,
            step=self._reader.increment,
            seam=max(seam, 1e-9) if self._reader.full_turn else 0.0,
            missing=options.missing_beams,
            flattest=options.flattest,
            sigma_range=max(lidar.sigma_range, options.sigma_range),
            sigma_bearing=max(lidar.sigma_bearing, options.sigma_bearing),
        )

    def extract(self, ranges: ArrayLike, motion: Array | None = None) -> LineMeasurements:
        """The lines of a scan, in the robot's frame as the last beam was sent.

        Args:
            ranges: (n,) m, as `ScanReader.read` has them.
            motion: (3,) how the robot moved during the scan, as there; left out, it stood still.

        Raises:
            ValueError: there is not one range for each beam of the lidar.
        """
        return self.lines_of(self._reader.read(ranges, motion))

    def lines_of(self, scan: Scan) -> LineMeasurements:
        """The lines of a scan that is read already."""
        options, spacing = self._options, self._spacing
        returns = returns_of(scan, spacing.sigma_range, spacing.sigma_bearing)
        if len(returns.beams) < options.min_beams:
            return no_lines()
        breaks = break_points(returns, spacing)
        first = beginning(returns, breaks, spacing)
        returns, breaks = rolled(returns, first), np.roll(breaks, -first)
        pieces = split_at_corners(
            returns, runs_between(breaks), options.split_sigmas, options.split_floor
        )
        stray = strays(len(breaks), pieces)
        fits = fit_and_merge(returns, pieces, stray, spacing, options.merge_gate)
        for _ in range(_SETTLING):
            pieces = settle_corners(returns, breaks, fits, stray)
            fits = fit_and_merge(returns, pieces, stray, spacing, options.merge_gate)
        return self._measurements(scan, returns, self._accepted(returns, fits))

    def _accepted(self, returns: Returns, fits: Fits) -> Fits:
        """Those that are long enough, of enough returns, and straight; from the first beam on."""
        ends = returns.points[fits.pieces % len(returns.beams)]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)
        good = fits.chi2 < largest_chi2(fits.counts)
        good &= (fits.counts >= self._options.min_beams) & (length >= self._options.min_length)
        first_beam = returns.beams[fits.pieces[:, 0] % len(returns.beams)]
        order = np.argsort(first_beam, kind="stable")
        return Fits(*(part[order[good[order]]] for part in fits))

    def _measurements(self, scan: Scan, returns: Returns, fits: Fits) -> LineMeasurements:
        beams = scan.ranges, scan.origins, scan.directions
        goes_on = open_ends(beams, returns, self._spacing, self._reach, fits.pieces, fits.lines)
        lines, covariances = _away_from_the_robot(fits)
        last_two = fits.pieces % len(returns.beams)
        places = places_along(lines[:, None], returns.points[last_two])
        sigmas = _sigmas_along(lines, returns, last_two)
        # Where the robot's origin lies on the other side of a line than the lidar, its tangent
        # points clockwise around the lidar.
        forward = np.argsort(places, axis=1, kind="stable")
        places, sigmas, goes_on = (
            np.take_along_axis(part, forward, axis=1) for part in (places, sigmas, goes_on)
        )
        return LineMeasurements(
            lines, covariances, points_on(lines[:, None], places), sigmas, goes_on
        )


def _away_from_the_robot(fits: Fits) -> tuple[Array, Array]:
    """The lines (k, 2) with r >= 0, and their covariances (k, 2, 2)."""
    negative = fits.lines[:, 0] < 0
    lines, covariances = fits.lines.copy(), fits.covariances.copy()
    lines[negative] = turned_over(lines[negative])
    covariances[negative] *= [[1.0, -1.0], [-1.0, 1.0]]
    lines[:, 1] = wrap(lines[:, 1])
    return lines, covariances


def _sigmas_along(lines: Array, returns: Returns, which: NDArray[np.intp]) -> Array:
    """(k, 2) how far noise moves returns (k, 2) along the lines (k, 2), one sigma [m]: SPEC 2.2."""
    u = tangents(lines[:, 1])[:, None, :]
    by_range = np.sum(u * returns.by_range[which], axis=-1)
    by_bearing = np.sum(u * returns.by_bearing[which], axis=-1)
    return np.asarray(np.hypot(by_range, by_bearing))
