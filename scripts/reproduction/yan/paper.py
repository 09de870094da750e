"""The numbers that the paper printed, by the names under which ours stand beside them."""

import numpy as np

from grouser.scripts.reproduction.figures import Figures, named

WORLDS = {"over_range": "yan-over-range", "normal": "yan-normal"}
"""The paper's two simulations, by the names of their figures, in the order of its table 1."""

OBSERVING_EVERY = 8
"""Steps from one look of the sensor to the next (SPEC 2.0)."""

ROWS = 3
"""Of table 1, for each world."""

_TABLE_1 = {
    "over_range": ((8.871066, 44.781379), (8.612084, 44.562109), (9.639981, 43.863622)),
    "normal": ((9.142181, 43.801663), (8.560958, 42.218549), (8.760142, 42.763733)),
}
"""s: a whole simulation by bisection, and point by point."""


def paper_figures() -> Figures:
    """All of them."""
    figures: Figures = {"paper.over_range_end_m": 54.4412}
    for world, rows in _TABLE_1.items():
        for number, (bisection, points) in enumerate(rows, 1):
            row = {"bisection_s": bisection, "points_s": points, "ratio": points / bisection}
            figures |= named(f"paper.table1.{world}_{number}", row)
    times = np.array(list(_TABLE_1.values())).reshape(-1, 2)
    return figures | {"paper.table1.ratio": float((times[:, 1] / times[:, 0]).mean())}
