"""What the paper says of the observer, section 2, against what is right (SPEC 2.1 and 2.3)."""

import numpy as np

from grouser.envs.sensors.line_observer import ClosedFormObserver
from grouser.geometry import Array
from grouser.scripts.reproduction.yan.observer_cases import random_segments

_REACH = 30.0
_STEPS = 60  # halvings: down to rounding


def visible_set(rng: np.random.Generator, points: int) -> dict[str, float]:
    """Share of visible points [%] in the set that is called observable: F > 0, and F <= 0."""
    distance = np.linalg.norm(rng.uniform(-40, 40, (points, 2)), axis=1)
    F, visible = distance - _REACH, distance <= _REACH
    return {
        "set.printed_percent": 100 * float((F > 0)[visible].mean()),
        "set.corrected_percent": 100 * float((F <= 0)[visible].mean()),
    }


def longer_half(rng: np.random.Generator, cases: int) -> dict[str, float]:
    """Largest error of the visible length [m] where the foot lies inside the segment: always OB
    is searched, and the longer half is."""
    segments = random_segments(rng, cases)
    A, d = segments[:, :2], segments[:, 2:] - segments[:, :2]
    foot = -np.sum(A * d, axis=1) / np.sum(d * d, axis=1)
    inside = (foot > 0) & (foot < 1)
    exact = np.nan_to_num(ClosedFormObserver().observe(segments, (0.0, 0.0), _REACH))
    lengths = np.linalg.norm(d, axis=1)
    worst = dict.fromkeys(("printed", "corrected"), 0.0)
    for k in np.nonzero(inside)[0]:
        for name, mirrored in (("printed", False), ("corrected", bool(foot[k] > 0.5))):
            first, last = _by_ob(A[k] + mirrored * d[k], d[k] * (-1 if mirrored else 1))
            error = abs((last - first) - (exact[k, 1] - exact[k, 0])) * lengths[k]
            worst[name] = max(worst[name], float(error))
    return {f"half.{name}_m": value for name, value in worst.items()}


def _by_ob(A: Array, d: Array) -> tuple[float, float]:
    """Fig. 4 taken at its word: B's half is searched, the end mirrored at the foot."""
    tf = float(-(A @ d) / (d @ d))
    if _F(A, d, tf) > 0:
        return 0.0, 0.0
    if _F(A, d, 1.0) <= 0:
        return 0.0, 1.0
    inside, outside = tf, 1.0
    for _ in range(_STEPS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if _F(A, d, middle) <= 0 else (inside, middle)
    return max(0.0, 2 * tf - inside), inside


def _F(A: Array, d: Array, t: float) -> float:
    p = A + t * d
    return float(p @ p - _REACH**2)
