"""Fits an error model to what a real estimator told: the parts one after another, each by least
squares.

Increments' errors are summed over windows, in which an error that lasts for one step cancels but at
the ends: how their variance grows with the window tells jitter and growth apart.
"""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from grouser.estimators.emulation.error_model import FEATURES, STATUSES, ErrorModel
from grouser.estimators.emulation.process import modelled_sigmas, on_the_spot
from grouser.estimators.emulation.record import Record, require_alike, sigmas
from grouser.geometry import Array, between

_WINDOW: Final = 10
"""Steps of a window in which drift shows."""
_LAGS: Final = (1, 3, 10, 30)
"""Steps of the windows by which the growth of variances is told."""
_SIGNIFICANT: Final = 3.0
"""Sigmas by which a correction must differ from none: any random walk seems to be drawn back."""
_FEWEST: Final = 100
"""A status seen in fewer windows shares the noise of all."""
_FEWEST_FOR_BIAS: Final = 20
"""Windows that tell systematic errors: of a run, or, where its are fewer, of all together."""
_FOUND: Final = 5
"""Steps in which what is found again is taken back."""
_SETTLED: Final = 20
"""Frames after which told sigmas are compared; at the start they are zero."""


def fit_error_model(records: Sequence[Record], *, of: str, source: str) -> ErrorModel:
    """The error model of an estimator, from its runs.

    Raises:
        ValueError: there are no runs, or their steps differ in length.
    """
    dt = require_alike(records)
    correction = _correction(records)
    bias_mean, bias_sigma, biases = _biases(records, correction)
    growth, jitter = _noise(records, correction, biases)
    values: dict[str, Any] = {
        "of": of,
        "dt": dt,
        "source": source,
        "runs": len(records),
        "bias_mean": bias_mean,
        "bias_sigma": bias_sigma,
        "correction": correction,
        "recovery": _recovery(records),
        "growth": growth,
        "jitter": jitter,
        "first_status": _first_status(records),
        "transitions": _transitions(records),
    }
    unscaled = ErrorModel(**values, confidence=np.ones((2, 2)))
    return ErrorModel(**values, confidence=_confidence(records, unscaled))


def _features(record: Record) -> Array:
    """(N - 1, 4) what systematic errors grow with in each step."""
    forward, turn = record.increments[:, 0], record.increments[:, 2]
    spot = [on_the_spot(d, a) for d, a in zip(forward, turn, strict=True)]
    return np.column_stack([forward, turn, np.abs(turn), spot])


def _grown(record: Record) -> Array:
    """(N - 1, 3) what variances grow with in each step."""
    step = np.abs(record.increments)
    return np.column_stack([np.ones(len(step)), step[:, 0], step[:, 2]])


def _gaps(record: Record) -> Array:
    """(N - 1, 3) the true pose seen from the told one, before each step; 0 where not tracking."""
    gap = between(record.told[:-1], record.truth[:-1])
    return np.where((record.status[1:] == 0)[:, None], gap, 0.0)


def _windows(values: Array, n: int) -> Array:
    """Sums over consecutive windows of n steps, which do not overlap."""
    whole = len(values) // n * n
    return np.asarray(values[:whole].reshape(-1, n, *values.shape[1:]).sum(axis=1))


def _windows_in(values: Array, record: Record, mode: int) -> Array:
    """Sums over those windows of _WINDOW steps in which the robot tracks (mode 0) all the time, or
    does not (mode 1)."""
    here = (_mode(record) == mode).astype(np.float64)
    return np.asarray(_windows(values, _WINDOW)[_windows(here, _WINDOW) == _WINDOW])


def _mode(record: Record) -> NDArray[np.int64]:
    """(N - 1,) 0 in steps that end TRACKING, 1 in others."""
    return np.asarray(record.status[1:] != 0, dtype=np.int64)


def _correction(records: Sequence[Record]) -> Array:
    """(3,) the share of the error that a step takes back: of its regression beside systematic
    errors that each run has of its own."""
    correction, n = np.zeros(3), len(FEATURES)
    for axis in range(3):
        errors, rows = [], []
        for k, record in enumerate(records):
            features = _windows_in(_features(record), record, 0)
            row = np.zeros((len(features), n * len(records) + 1))
            row[:, n * k : n * (k + 1)] = features
            # The error before the window: those within it hold the window's own noise.
            before = np.zeros_like(record.increments)
            before[::_WINDOW] = _WINDOW * _gaps(record)[::_WINDOW]
            row[:, -1] = _windows_in(before, record, 0)[:, axis]
            rows.append(row)
            errors.append(_windows_in(record.increment_errors, record, 0)[:, axis])
        gain, sigma = _last_coefficient(np.concatenate(rows), np.concatenate(errors))
        if gain > _SIGNIFICANT * sigma:
            correction[axis] = _share_a_step(gain * _WINDOW)
    return correction


def _recovery(records: Sequence[Record]) -> Array:
    """(3,) the share of the error that is taken back when TRACKING follows another status."""
    pairs = [_around_recoveries(record) for record in records]
    before, after = (np.concatenate(part) for part in zip(*pairs, strict=True))
    left = (before * after).sum(axis=0) / np.maximum((before**2).sum(axis=0), 1e-12)
    return np.clip(1.0 - left, 0.0, 1.0) if len(before) else np.zeros(3)


def _around_recoveries(record: Record) -> tuple[Array, Array]:
    """(n, 3) errors before TRACKING follows another status, and _FOUND steps later, of those after
    which it lasts so long."""
    tracks, last = record.status == 0, len(record.status) - _FOUND
    begun = np.flatnonzero(tracks[1:] & ~tracks[:-1]) + 1
    lasting = [k for k in begun.tolist() if k <= last and tracks[k : k + _FOUND].all()]
    at = np.array(lasting, dtype=np.int64)
    return record.errors[at - 1], record.errors[at + _FOUND - 1]


def _share_a_step(of_window: float) -> float:
    """What each step takes back where a window of them takes back this share."""
    return -math.expm1(math.log1p(-min(of_window, 0.99)) / _WINDOW)


def _last_coefficient(rows: Array, values: Array) -> tuple[float, float]:
    """The last coefficient of a linear regression and its sigma."""
    if not rows[:, -1].any():
        return 0.0, 1.0
    solution, *_ = np.linalg.lstsq(rows, values, rcond=None)
    left = values - rows @ solution
    free = max(len(values) - rows.shape[1], 1)
    variance = np.linalg.pinv(rows.T @ rows)[-1, -1] * float(left @ left) / free
    return float(solution[-1]), float(np.sqrt(variance))


def _uncorrected(record: Record, correction: Array) -> Array:
    """(N - 1, 3) increments' errors without what was taken back."""
    return record.increment_errors - correction * _gaps(record)


def _biases(records: Sequence[Record], correction: Array) -> tuple[Array, Array, Array]:
    """Mean and sigma (2, 3, 4) of systematic errors over the runs, and those (runs, 2, 3, 4) of
    each; a mode that is never seen for long has the errors of the other."""
    modes = [_biases_in(mode, records, correction) for mode in (0, 1)]
    seen = [mode for mode in modes if mode is not None]
    if not seen:
        raise ValueError("no run holds one status for long enough to fit to; give longer runs")
    mean, sigma, each = (
        np.stack([mode[part] if mode else seen[0][part] for mode in modes], axis=axis)
        for part, axis in ((0, 0), (1, 0), (2, 1))
    )
    return mean, sigma, each


def _biases_in(
    mode: int, records: Sequence[Record], correction: Array
) -> tuple[Array, Array, Array] | None:
    """Mean and sigma (3, 4), and those of each run (runs, 3, 4), in one mode; a run that is not in
    it for long has the mean."""
    pairs = [
        (
            _windows_in(_features(record), record, mode),
            _windows_in(_uncorrected(record, correction), record, mode),
        )
        for record in records
    ]
    together = [np.concatenate(part) for part in zip(*pairs, strict=True)]
    if len(together[0]) < _FEWEST_FOR_BIAS:
        return None
    pooled, _ = _systematic(*together)
    told = {k: _systematic(*p) for k, p in enumerate(pairs) if len(p[0]) >= _FEWEST_FOR_BIAS}
    if len(told) < 2:
        return pooled, np.zeros_like(pooled), np.array([pooled] * len(records))
    values = np.array([solution for solution, _ in told.values()])
    # What runs differ by because each tells its own only roughly is no difference.
    spread = values.var(axis=0, ddof=1) - np.mean([u for _, u in told.values()], axis=0)
    mean = np.asarray(values.mean(axis=0))
    each = [told[k][0] if k in told else mean for k in range(len(records))]
    return mean, np.sqrt(np.maximum(spread, 0.0)), np.array(each)


def _systematic(features: Array, errors: Array) -> tuple[Array, Array]:
    """Systematic errors (3, 4) that windows tell, and the variance of each."""
    solution, *_ = np.linalg.lstsq(features, errors, rcond=None)
    left = (errors - features @ solution).var(axis=0)
    variance = np.outer(left, np.diag(np.linalg.pinv(features.T @ features)))
    return np.asarray(solution.T, dtype=np.float64), variance


def _noise(records: Sequence[Record], correction: Array, biases: Array) -> tuple[Array, Array]:
    """Growth (3, 3, 3) and jitter (3, 3), as `ErrorModel` has them."""
    rows, squares, statuses = [], [], []
    for record, bias in zip(records, biases, strict=True):
        said = np.einsum("kij,kj->ki", bias[_mode(record)], _features(record))
        left = _uncorrected(record, correction) - said
        for lag in _LAGS:
            grown, n = _windows(_grown(record), lag), len(record.status[1:]) // lag * lag
            rows.append(np.column_stack([np.full(len(grown), 2.0), grown]) / lag)
            squares.append(_windows(left, lag) ** 2 / lag)
            status = record.status[1:][:n].reshape(-1, lag)
            same = (status == status[:, :1]).all(axis=1)
            statuses.append(np.where(same, status[:, 0], -1))
    row, square, status = map(np.concatenate, (rows, squares, statuses))
    growth, jitter = np.zeros((3, 3, 3)), np.zeros((3, 3))
    for index in range(len(STATUSES)):
        these = status == index
        these = these if these.sum() >= _FEWEST else status >= 0
        for axis in range(3):
            solution, _ = nnls(row[these], square[these, axis])
            jitter[index, axis], growth[index, axis] = np.sqrt(solution[0]), solution[1:]
    return growth, jitter


def _first_status(records: Sequence[Record]) -> Array:
    counts = np.bincount([record.status[0] for record in records], minlength=len(STATUSES))
    return np.asarray(counts / counts.sum())


def _transitions(records: Sequence[Record]) -> Array:
    """(3, 3) probabilities; a status that was never left goes back to the most frequent one."""
    counts = np.zeros((len(STATUSES), len(STATUSES)))
    for record in records:
        np.add.at(counts, (record.status[:-1], record.status[1:]), 1.0)
    usual = int(counts.sum(axis=0).argmax())
    counts[counts.sum(axis=1) == 0, usual] = 1.0
    return np.asarray(counts / counts.sum(axis=1, keepdims=True))


def _confidence(records: Sequence[Record], model: ErrorModel) -> Array:
    """(2, 2) the median of told sigmas over modelled ones, of position and heading, while it tracks
    and while it does not; a mode that is never seen has that of the other."""
    told, modes = [], []
    for record in records:
        modelled = modelled_sigmas(model, record.truth, record.status)[_SETTLED:]
        told.append(sigmas(record.covariance[_SETTLED:]) / np.maximum(modelled, 1e-12))
        modes.append(record.status[_SETTLED:] != 0)
    ratio, mode = np.concatenate(told), np.concatenate(modes)
    each = [ratio[mode == other] for other in (False, True)]
    seen = [part if len(part) else ratio for part in each]
    return np.array([np.median(part, axis=0) for part in seen])
