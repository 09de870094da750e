"""The filter of paper 2: a pose and the lines around it, by (r, alpha) (SPEC 2.2)."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from grouser.checks import require_positive
from grouser.estimators.base import Observation
from grouser.estimators.line_slam.association import (
    AssociationOptions,
    Pairs,
    associate,
    ends_in_world,
    turned_about,
)
from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.linearization import Linearization, jacobian
from grouser.estimators.line_slam.lines import lines_to_world, points_on
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.merging import EXACT, MergingOptions, Twins, find_twins
from grouser.estimators.line_slam.motion import MotionModel
from grouser.estimators.line_slam.predict import predict
from grouser.estimators.line_slam.sightings import Sightings
from grouser.estimators.line_slam.sparse_update import absorb, correct
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
        self.state, self.end_points = state, EndPoints()
        self.sightings = Sightings(options.patience)
        self._motion, self._linearization, self._options = motion, linearization, options
        self.unevenness = unevenness
        self._slipped = np.zeros(POSE)
        self._W = np.zeros((2 * _LINES_IN_A_SCAN, len(state.mean)))

    def start(self, seen: LineMeasurements | None) -> Told:
        """What the first observation shows comes to the map; the pose is zero by definition."""
        learns = self._options.learns and seen is not None
        return self.look(seen) if learns and seen is not None else Told(measured=True)

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
        self.sightings.next_scan()
        by_noise, seen = seen, self.unevenness.widened(seen)
        good = np.sqrt(seen.covariances[:, 1, 1]) < self._options.alpha_sigma_most
        by_noise, seen = by_noise[good], seen[good]
        d2: list[float] = []
        matched: list[int] = []
        together: list[tuple[Array, Array]] = []
        left = np.arange(len(seen))
        for again in range(2):  # what the first corrections leave open, the map may tell then
            pairs = self._associate(seen[left]) if again else self._associate_or_doubt(seen)
            if not again:
                self._learn_unevenness(by_noise, pairs)
            which, believed, fits = self._correct(seen[left], pairs)
            d2 += fits
            matched += believed
            together.append((self.state.lines[believed], seen.lines[left[which]]))
            new = left[pairs.new]
            left = np.setdiff1d(left, left[pairs.seen])
            if not len(left):
                break
        self.sightings.again(np.array(matched, dtype=np.intp))
        if self._options.learns:
            new = np.intersect1d(new, left)
            new = new[np.sqrt(seen.covariances[new, 1, 1]) < self._options.alpha_sigma_new]
            self._insert(seen[new])
            self._merge(matched)
            self._forget_doubtful()
        nis = float(np.mean(d2)) if d2 else float("nan")
        return Told(measured, len(seen), len(d2), len(new), nis, tuple(together))

    def know(self, line_map: LineMap) -> None:
        """Take the lines of a map with their joint covariance, before anything is seen."""
        state = self.state
        at = state.size
        for line, extent, open_ends, count in zip(
            line_map.lines, line_map.extents, line_map.open_ends, line_map.counts, strict=True
        ):
            state.add(line, (), np.zeros((2, 0)), np.zeros((2, 2)))
            self._linearization.added(state)
            self.end_points.add(line, points_on(line, extent), np.zeros(2), open_ends)
            self.sightings.add(int(count))
        state.buffer[at : state.size, at : state.size] = line_map.covariance
        self._fit_buffer()

    def known(self) -> LineMap:
        """The lines as they are known now."""
        return LineMap(
            lines=self.state.lines,
            covariance=self.state.covariance(range(self.state.head, self.state.size)),
            extents=self.end_points.extents,
            open_ends=self.end_points.open_ends,
            counts=self.sightings.counts,
        )

    def _associate(self, seen: LineMeasurements) -> Pairs:
        self._linearization.begin(self.state)
        rows = self._linearization.jacobians(self.state)
        return associate(self.state, rows, self.end_points, seen, self._options.association)

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

    def _correct(
        self, seen: LineMeasurements, pairs: Pairs
    ) -> tuple[list[int], list[int], list[float]]:
        """By one line after another: those seen that still fit after the ones before them, the
        lines of the map that they are, and their d2."""
        state, used = self.state, 0
        d2: list[float] = []
        self._linearization.begin(state)
        believed: list[tuple[int, int]] = []
        for i, line in zip(pairs.seen.tolist(), pairs.lines.tolist(), strict=True):
            row = self._linearization.jacobians(state, slice(line, line + 1))[0]
            residual, R = self._innovation(seen.lines[i], seen.covariances[i], line)
            indices = np.array([0, 1, 2, *state.states_of(line)], dtype=np.intp)
            gate = self._options.association.gate
            change, fit = correct(
                state.buffer, state.size, self._W, used, indices, jacobian(row), R, residual, gate
            )
            if fit <= gate:
                self._linearization.correct(state, change)
                used += 2
                d2.append(fit)
                believed.append((i, line))
            if used == len(self._W):
                absorb(state.buffer, state.size, self._W, used)
                used = 0
        absorb(state.buffer, state.size, self._W, used)
        self._linearization.end(state)
        ends = ends_in_world(seen.ends, state.pose)
        for i, line in believed:
            self.end_points.extend(
                line, state.lines[line], ends[i], seen.end_sigmas[i], seen.open_ends[i]
            )
        return [i for i, _ in believed], [line for _, line in believed], d2

    def _innovation(self, z: Array, R: Array, line: int) -> tuple[Array, Array]:
        """nu and its R; turned over where the map has the line written the other way about."""
        r, alpha = self.state.lines[line].tolist()
        x, y, heading = self.state.pose.tolist()
        h = r - x * math.cos(alpha) - y * math.sin(alpha)
        turn = math.remainder(float(z[1]) - alpha + heading, math.tau)
        if abs(turn) <= math.pi / 2 or self._options.association.two_sided:
            return np.array([z[0] - h, turn]), R
        return np.array([-z[0] - h, math.remainder(turn + math.pi, math.tau)]), R * _TURNED_OVER

    def _insert(self, seen: LineMeasurements) -> None:
        """New lines: a = a_l + heading, r = r_l + x cos a + y sin a."""
        state = self.state
        for i, line in enumerate(lines_to_world(seen.lines, state.pose)):
            n, lever = np.array([np.cos(line[1]), np.sin(line[1])]), _lever(line, state.pose)
            Gv = np.array([[n[0], n[1], lever], [0.0, 0.0, 1.0]])
            Gz = np.array([[1.0, lever], [0.0, 1.0]])
            state.add(line, range(POSE), Gv, Gz @ seen.covariances[i] @ Gz.T)
            self._linearization.added(state)
            ends = ends_in_world(seen.ends[i], state.pose)
            self.end_points.add(line, ends, seen.end_sigmas[i], seen.open_ends[i])
            self.sightings.add()
        self._fit_buffer()

    def _fit_buffer(self) -> None:
        if self._W.shape[1] < len(self.state.mean):
            self._W = np.zeros((len(self._W), len(self.state.mean)))

    def _merge(self, moved: list[int]) -> None:
        """Look for twins of the lines that this scan moved, and make one line of two."""
        options, two_sided = self._options.merging, self._options.association.two_sided
        while moved:
            line = moved.pop()
            twins = find_twins(self.state, self.end_points, line, options, two_sided=two_sided)
            if twins is None:
                continue
            self._unite(twins)
            moved = [twins.kept] + [at - (at > twins.gone) for at in moved if at != twins.gone]

    def _unite(self, twins: Twins) -> None:
        """Correct by a difference that is known to be zero, then forget the younger line."""
        state = self.state
        self._linearization.begin(state)
        indices = np.array(twins.indices, dtype=np.intp)
        change, _ = correct(
            state.buffer, state.size, self._W, 0, indices, twins.H, EXACT, -twins.difference, np.inf
        )
        self._linearization.correct(state, change)
        absorb(state.buffer, state.size, self._W, 2)
        self._linearization.end(state)
        self.end_points.join(twins.kept, twins.gone, state.lines)
        self.sightings.join(twins.kept, twins.gone)
        state.forget(twins.gone)
        self._linearization.forgot(twins.gone)

    def _forget_doubtful(self) -> None:
        for line in self.sightings.doubtful():
            self._forget(int(line))

    def _forget(self, line: int) -> None:
        self.state.forget(line)
        self._linearization.forgot(line)
        self.end_points.forget(line)
        self.sightings.forget(line)


def _lever(line: Array, pose: Array) -> float:
    """Derivative of r by the heading, and by alpha as it was seen: -x sin a + y cos a."""
    return float(-pose[0] * np.sin(line[1]) + pose[1] * np.cos(line[1]))


_TURNED_OVER = np.array([[1.0, -1.0], [-1.0, 1.0]])
_LINES_IN_A_SCAN = 64
_SLIP_FLOOR = np.array([0.005, 0.005, 0.005])  # m, m, rad: one sigma, beside the motion itself
