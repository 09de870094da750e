"""A map for tests, of lines at random."""

import numpy as np

from grouser.estimators.line_slam.map import LineMap


def random_map(n: int, *, seed: int = 0, sigma: float = 0.05) -> LineMap:
    """n lines with a joint covariance that is full."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(2 * n, 2 * n + 3)) * sigma / np.sqrt(2 * n + 3)
    factor[1::2] *= 0.1  # rad, per m
    extents = np.sort(rng.uniform(-20, 20, (n, 2)), axis=1)
    return LineMap(
        lines=np.column_stack([rng.uniform(-5, 30, n), rng.uniform(-np.pi, np.pi, n)]),
        covariance=factor @ factor.T,
        extents=extents,
        open_ends=rng.random((n, 2)) < 0.5,
        counts=rng.integers(1, 1000, n),
    )
