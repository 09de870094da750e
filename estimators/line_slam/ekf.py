"""The filter of paper 2: a pose and the lines around it, by (r, alpha) (SPEC 2.2)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_positive
from grouser.estimators.base import Observation
from grouser.estimators.line_slam.association import (
    AssociationOptions,
    Pairs,
    associate,
    turned_about,
)
from grouser.estimators.line_slam.correction import Corrector
from grouser.estimators.line_slam.landmarks import Landmarks
from grouser.estimators.line_slam.linearization import Linearization
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.merging import MergingOptions, find_twins
from grouser.estimators.line_slam.motion import MotionModel
from grouser.estimators.line_slam.predict import predict
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.estimators.line_slam.unevenness import Unevenness, of_uneven
from grouser.geometry import Array, between


@dataclass(frozen=True, slots=True)
class LineEkfOptions:
    """What becomes a line of the map, and which lines correct the pose."""

    association: AssociationOptions = field(default_factory=AssociationOptions)
    merging: MergingOptions = field(default_factory=MergingOptions)
    alpha_sigma_most: float = 0.15
    """rad, to which the direction of a line that is used is known; short parts linearise badly."""
    alpha_sigma_new: float = 0.07
    """rad: that of a line that is new."""
    patience: int = 20
    """Scans after which a line that was seen once is forgotten."""
    learns: bool = True
    """Whether lines come to the map; if not, the filter finds its way by the map it has."""

    def __post_init__(self) -> None:
        require_positive(self, "alpha_sigma_most", "alpha_sigma_new")


@dataclass(frozen=True, slots=True)
class Told:
    """What a step of the filter saw."""

    measured: bool
    """Whether the motion was measured."""
    seen: int = 0
    """Lines that were good enough."""
    matched: int = 0
    """Of them, lines of the map, that corrected it."""
    new: int = 0
    nis: float = float("nan")
    """Mean of the matched lines' squared innovations over their covariance; 2 is honest."""
    pairs: tuple[tuple[Array, Array], ...] = ()
    """Lines of the map (k, 2) that were matched, as they were corrected, and beside each what was
    seen of it (k, 2) from the robot; one correction after another."""


class _Corrected(NamedTuple):
    """What pose and map were corrected by."""

    lines: NDArray[np.intp]
    """(k,) of the map"""
    as_corrected: Array
    """(k, 2) these"""
    seen: Array
    """(k, 2) from the robot"""
    d2: list[float]
    """k"""


class LineEkf:
    """Predict, associate, correct; then the map: its ends, new lines, twins, doubtful lines."""

    def __init__(
        self,
        state: LineState,
        motion: MotionModel,
        linearization: Linearization,
        unevenness: Unevenness,
        options: LineEkfOptions,
    ) -> None:
        """
        Args:
            state: no line yet, or those of a map, which `know` tells of.
            unevenness: of what the lines are seen on.
        """
        self._landmarks = Landmarks(state, linearization, options.patience)
        self._motion, self._linearization, self._options = motion, linearization, options
        self._corrector = Corrector(
            linearization, gate=options.association.gate, two_sided=options.association.two_sided
        )
        self.unevenness = unevenness
        self._slipped = np.zeros(POSE)

    @property
    def state(self) -> LineState:
        """Pose, constant errors and lines."""
        return self._landmarks.state

    def start(self, seen: LineMeasurements | None) -> Told:
        """What the first observation shows comes to the map; the pose is zero by definition."""
        if seen is None or not self._options.learns:
            return Told(measured=True)
        return self.look(seen)

    def step(
        self, observation: Observation, see: Callable[[Array], LineMeasurements | None]
    ) -> Told:
        """Take one observation.

        Args:
            see: what lines it shows, given how the robot moved (3,) since the one before; None
                where nobody looked.
        """
        before = self.state.pose.copy()
        measured = predict(
            self.state,
            self._motion,
            observation,
            lambda step: self._linearization.step(self.state, step),
        )
        moved = between(before, self.state.pose)
        self._slipped = np.zeros(3)
        if self._motion.slips:
            self._slipped = np.abs(moved) + _SLIP_FLOOR
        seen = see(moved)
        told = Told(measured) if seen is None else self.look(seen, measured=measured)
        self._motion.learn(before, self.state.pose.copy())
        return told

    def look(self, seen: LineMeasurements, *, measured: bool = True) -> Told:
        """Correct pose and map by the lines of one scan, and let the map grow."""
        self._landmarks.sightings.next_scan()
        by_noise, seen = seen, self.unevenness.widened(seen)
        good = np.sqrt(seen.covariances[:, 1, 1]) < self._options.alpha_sigma_most
        if not good.all():
            by_noise, seen = by_noise[good], seen[good]
        corrected, new = self._correct_by(seen, by_noise)
        matched = [line for one in corrected for line in one.lines.tolist()]
        d2 = [fit for one in corrected for fit in one.d2]
        self._landmarks.sightings.again(np.array(matched, dtype=np.intp))
        if self._options.learns:
            if len(new):
                known = np.sqrt(seen.covariances[new, 1, 1]) < self._options.alpha_sigma_new
                new = new[known]
                self._landmarks.insert(seen[new])
            self._merge(matched)
            self._landmarks.forget_doubtful()
        nis = sum(d2) / len(d2) if d2 else float("nan")
        pairs = tuple((one.as_corrected, one.seen) for one in corrected)
        return Told(measured, len(seen), len(d2), len(new), nis, pairs)

    def know(self, line_map: LineMap) -> None:
        """Take the lines of a map with their joint covariance, before anything is seen."""
        self._landmarks.know(line_map)

    def known(self) -> LineMap:
        """The lines as they are known now."""
        return self._landmarks.known()

    def _correct_by(
        self, seen: LineMeasurements, by_noise: LineMeasurements
    ) -> tuple[list[_Corrected], NDArray[np.intp]]:
        """Correct pose and map; and which of the lines seen are new, (k,).

        Args:
            by_noise: what was seen, as sure as it is of even walls.
        """
        pairs = self._associate_or_doubt(seen)
        self._learn_unevenness(by_noise, pairs)
        corrected = [self._correct(seen, pairs)]
        open = np.ones(len(seen), dtype=np.bool_)
        open[pairs.seen] = False
        if not open.any():
            return corrected, pairs.new
        # What the first corrections leave open, the map may tell then.
        left = np.nonzero(open)[0]
        pairs = self._associate(seen[left])
        return [*corrected, self._correct(seen[left], pairs)], left[pairs.new]

    def _correct(self, seen: LineMeasurements, pairs: Pairs) -> _Corrected:
        """By the lines of the map that still fit after the ones before them."""
        believed, d2 = self._corrector.by_lines(self.state, seen, pairs)
        lines, seen = pairs.lines[believed], seen[pairs.seen[believed]]
        self._landmarks.extend(lines, seen)
        return _Corrected(lines, self.state.lines[lines], seen.lines, d2)

    def _associate(self, seen: LineMeasurements) -> Pairs:
        self._linearization.begin(self.state)
        rows = self._linearization.jacobians(self.state)
        return associate(
            self.state, rows, self._landmarks.end_points, seen, self._options.association
        )

    def _associate_or_doubt(self, seen: LineMeasurements) -> Pairs:
        """Where most lines do not fit, the motion may not have been what was reported: if more of
        them fit together after any other motion of that size, it was not, and its covariance says
        so from now on. Without it, a slip puts the whole map beside itself once more."""
        pairs, state = self._associate(seen), self.state
        if 2 * len(pairs.seen) >= len(seen) or not self._slipped.any():
            return pairs
        kept = state.buffer[:POSE, :POSE].copy()
        state.buffer[:POSE, :POSE] += np.diag(self._slipped**2)
        doubting = self._associate(seen)
        if len(doubting.seen) >= max(2, len(pairs.seen) + 1):
            return doubting
        state.buffer[:POSE, :POSE] = kept
        return pairs

    def _learn_unevenness(self, by_noise: LineMeasurements, pairs: Pairs) -> None:
        if not len(pairs.seen) or not self.unevenness.learns:
            return
        paired = by_noise[pairs.seen]
        S = pairs.spread.transpose(0, 2, 1, 3).copy()
        k = np.arange(len(paired))
        S[k, :, k, :] += turned_about(paired.covariances, pairs.turned)
        self.unevenness.learn(
            pairs.residuals.reshape(-1),
            S.reshape(2 * len(paired), -1),
            turned_about(of_uneven(paired), pairs.turned),
        )

    def _merge(self, moved: list[int]) -> None:
        """Look for twins of the lines that this scan moved, and make one line of two."""
        options, two_sided = self._options.merging, self._options.association.two_sided
        ends = self._landmarks.end_points
        while moved:
            line = moved.pop()
            twins = find_twins(self.state, ends, line, options, two_sided=two_sided)
            if twins is None:
                continue
            self._corrector.by_twins(self.state, twins)
            self._landmarks.join(twins.kept, twins.gone)  # the younger one is forgotten
            moved = [twins.kept] + [at - (at > twins.gone) for at in moved if at != twins.gone]


_SLIP_FLOOR = np.array([0.005, 0.005, 0.005])  # m, m, rad: one sigma, beside the motion itself
