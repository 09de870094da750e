"""Noise on recorded increments, so that one log makes as many runs as there are seeds."""

import numpy as np

from grouser.geometry import Array, compose


def with_noise(name: str, increments: Array, share: float, rng: np.random.Generator) -> Array:
    """Increments (N, k) with white noise; the first one, of the start, stays zero.

    Args:
        name: "tracks": each by `share` of itself, one sigma. "odometry": x and y by `share` of the
            way [m per m], heading by `share` of the way [rad per m] and of the turn [rad per rad].
        increments: as the observation of that name.
        share: one sigma.
        rng: what it is drawn from, the same amount whatever the share.
    """
    drawn = rng.standard_normal((len(increments), 4))
    drawn[0] = 0.0
    if name == "tracks":
        noisy: Array = increments * (1 + share * drawn[:, :2])
        return noisy
    way = np.hypot(increments[:, 0], increments[:, 1])
    turn = np.abs(increments[:, 2])
    off = share * np.column_stack(
        [way * drawn[:, 0], way * drawn[:, 1], way * drawn[:, 2] + turn * drawn[:, 3]]
    )
    return compose(increments, off)
