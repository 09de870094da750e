"""Do emulated errors look like real ones? Distributions of both along the same true ways."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from grouser.estimators.emulation.error_model import ErrorModel
from grouser.estimators.emulation.process import emulate
from grouser.estimators.emulation.record import Record, sigmas
from grouser.geometry import Array, between

DRAWS: Final = 10
"""Emulated runs for each real one."""

_SEGMENT: Final = 3.0  # m of way
_QUANTILES: Final = np.linspace(0.05, 0.95, 19)

MEASURES: Final[Mapping[str, str]] = {
    "position": "position error, m",
    "heading": "heading error, rad",
    "drift": f"position error gained over {_SEGMENT:g} m, m",
    "turning": f"heading error gained over {_SEGMENT:g} m, rad",
    "position_sigma": "told sigma of position, m",
    "heading_sigma": "told sigma of heading, rad",
}
"""What is compared, in words."""


@dataclass(frozen=True, slots=True, eq=False)
class Agreement:
    """Samples of each of MEASURES, pooled over frames and runs."""

    real: Mapping[str, Array]
    emulated: Mapping[str, Array]

    def distance(self, measure: str) -> float:
        """How far quantiles (5 % to 95 %) of emulated and real samples are apart on average, as a
        share of the real ones' mean; 0 is the same distribution."""
        real, emulated = (np.quantile(s[measure], _QUANTILES) for s in (self.real, self.emulated))
        return float(np.abs(emulated - real).mean() / max(real.mean(), 1e-12))

    def distances(self) -> dict[str, float]:
        """Those of all measures."""
        return {measure: self.distance(measure) for measure in MEASURES}


def agreement(model: ErrorModel, records: Sequence[Record], *, seed: int) -> Agreement:
    """Emulate along the true ways of real runs, DRAWS times each, and sample both.

    The runs should not be those that the model was fitted to.
    """
    rng = np.random.default_rng(seed)
    real = [_samples(record.truth, record.told, record.covariance) for record in records]
    drawn = [
        _samples(record.truth, *emulate(model, record.truth, rng))
        for record in records
        for _ in range(DRAWS)
    ]
    return Agreement(_pooled(real), _pooled(drawn))


def _samples(truth: Array, told: Array, covariance: Array) -> dict[str, Array]:
    error, gained, sigma = between(truth, told), _gained(truth, told), sigmas(covariance)
    return {
        "position": np.linalg.norm(error[1:, :2], axis=1),
        "heading": np.abs(error[1:, 2]),
        "drift": np.linalg.norm(gained[:, :2], axis=1),
        "turning": np.abs(gained[:, 2]),
        "position_sigma": sigma[1:, 0],
        "heading_sigma": sigma[1:, 1],
    }


def _gained(truth: Array, told: Array) -> Array:
    """(n, 3) error of the motion told over segments of way, which do not overlap."""
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1)))
    ends = np.searchsorted(way, np.arange(0.0, way[-1], _SEGMENT))
    a, b = ends[:-1], ends[1:]
    return between(between(truth[a], truth[b]), between(told[a], told[b]))


def _pooled(samples: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([each[name] for each in samples]) for name in MEASURES}
