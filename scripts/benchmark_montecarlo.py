"""How accurate and how honest the recommended estimator is in the synthetic world of SPEC 1.7."""

import numpy as np

from grouser.scripts.benchmark_timing import Figures, Measurement
from grouser.scripts.montecarlo_runs import RECOMMENDED, run_all
from grouser.scripts.montecarlo_score import Mean, summarise

_SEEDS = 10
_DRIVES = ("linear", "spot", "free", "sideslip")
_REGULAR = ("linear", "spot", "free")
"""Drives whose NEES is one figure."""


def accuracy() -> Figures:
    """Errors at the end of the drives, means over seeds, and the pose's NEES (3 is honest)."""
    drives = run_all(_DRIVES, [RECOMMENDED], _SEEDS)
    means = summarise(score for scores in drives for score in scores)
    of: dict[str, Mean] = {scenario: mean for (scenario, _), mean in means.items()}
    return {
        "montecarlo.linear_mm": (of["linear"].mm, "mm"),
        "montecarlo.linear_deg": (of["linear"].degrees, "deg"),
        "montecarlo.spot_deg": (of["spot"].degrees, "deg"),
        "montecarlo.free_mm": (of["free"].mm, "mm"),
        "montecarlo.nees": (float(np.mean([of[name].nees for name in _REGULAR])), "3 is honest"),
        "montecarlo.sideslip_nees": (of["sideslip"].nees, "3 is honest"),
    }


MEASUREMENTS = (
    Measurement(
        accuracy,
        (
            "montecarlo.linear_mm",
            "montecarlo.linear_deg",
            "montecarlo.spot_deg",
            "montecarlo.free_mm",
            "montecarlo.nees",
            "montecarlo.sideslip_nees",
        ),
    ),
)
