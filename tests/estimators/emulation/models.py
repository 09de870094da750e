"""Error models and ways to drive for the tests of emulators."""

from typing import Any

import numpy as np

from grouser.estimators.emulation.error_model import ErrorModel
from grouser.estimators.emulation.process import emulate
from grouser.estimators.emulation.record import Record
from grouser.geometry import Array, compose, exp

DT = 0.1


def model(**changes: Any) -> ErrorModel:
    """A model without errors, but for what is given."""
    values: dict[str, Any] = {
        "of": "test",
        "dt": DT,
        "source": "nowhere",
        "runs": 1,
        "bias_mean": np.zeros((2, 3, 4)),
        "bias_sigma": np.zeros((2, 3, 4)),
        "correction": np.zeros(3),
        "recovery": np.zeros(3),
        "growth": np.zeros((3, 3, 3)),
        "jitter": np.zeros((3, 3)),
        "first_status": [1, 0, 0],
        "transitions": np.eye(3),
        "confidence": np.ones((2, 2)),
    }
    return ErrorModel(**{**values, **changes})


def drifting(**changes: Any) -> ErrorModel:
    """Errors of every kind: systematic ones, growing ones, and ones that last for a step."""
    growth = np.zeros((3, 3, 3))
    growth[:] = np.array([[1e-6, 4e-4, 0.0], [1e-6, 1e-4, 0.0], [1e-7, 2e-5, 1e-4]])
    mean = np.array([[0.03, 0, 0.01, 0], [0, 0.02, 0, 0], [0.01, -0.04, 0, 0.03]])
    sigma = np.array([[0.02, 0, 0, 0], [0, 0.01, 0, 0], [0.005, 0.03, 0, 0.02]])
    return model(
        **{
            "bias_mean": np.array([mean, mean]),
            "bias_sigma": np.array([sigma, sigma]),
            "growth": growth,
            "jitter": np.full((3, 3), 2e-3),
            **changes,
        }
    )


def way(n: int, seed: int = 0) -> Array:
    """(n + 1, 3) a drive of arcs, straight lines and turns on the spot."""
    rng, poses = np.random.default_rng(seed), [np.zeros(3)]
    for k in range(n):
        if k % 15 == 0:
            twist = [rng.choice([0.0, 0.3, 0.4]), 0.0, rng.uniform(-0.8, 0.8)]
        poses.append(compose(poses[-1], exp(DT * np.array(twist))))
    return np.array(poses)


def record(errors: ErrorModel, n: int, seed: int) -> Record:
    """A run of an emulator, all of it in the first status."""
    truth = way(n, seed)
    told, covariance = emulate(errors, truth, np.random.default_rng(seed))
    return Record(DT, truth, told, covariance, np.zeros(n + 1, dtype=np.int64))
