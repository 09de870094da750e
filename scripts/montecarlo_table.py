"""The Monte Carlo's table, as SPEC 1.7 has it, and the prototype's figures beside it."""

from collections.abc import Mapping, Sequence

from rich.table import Table

from grouser.scripts.montecarlo_runs import METHODS
from grouser.scripts.montecarlo_scenarios import SCENARIOS
from grouser.scripts.montecarlo_score import Mean

PROTOTYPE = {
    "dead-reckoning": {
        "linear": "19 / .78",
        "linear-offset": "22 / 1.0",
        "slip": "20 / .51",
        "spot-offset": "2 / 9.7",
        "spot-slip": "2 / 54",
        "free": "915 / 15",
    },
    "one-point-frames": {
        "linear": "30 / .11",
        "linear-offset": "28 / .08",
        "slip": "21 / .10",
        "spot-offset": "26 / .135",
        "spot-slip": "26 / .135",
        "free": "19 / .11",
    },
    "one-point-frames-tracks": {
        "linear": "4.4 / .12 (1.7)",
        "linear-offset": "2.7 / .08",
        "slip": "5.0 / .13 (1.0)",
        "blackout": "9 / .36",
        "spot-offset": "2.4 / .10",
        "spot-slip": "2 / .11",
        "free": "39 / .10 (2.6)",
    },
    "one-point-keyframes": {
        "linear": "8.5 / .041",
        "linear-offset": "9.5 / .029",
        "slip": "12.7 / .037",
        "sideslip": "9.4 / .22",
        "spot-offset": "11 / .027",
        "spot-slip": "11 / .02",
        "free": "11 / .045",
    },
    "one-point": {
        "linear": "4.4 / .028 (1.4)",
        "slip": "5.1 / .031 (2.1)",
        "sideslip": "22 / .51 (27)",
        "blackout": "10 / .34",
        "spot-slip": "1.7 / .056 (1.4)",
        "free": "11.7 / .034 (1.8)",
    },
}
"""SPEC 1.7: mm / degrees (NEES), by method and scenario."""


def score_table(
    means: Mapping[tuple[str, str], Mean], scenarios: Sequence[str], methods: Sequence[str]
) -> Table:
    """A section a drive, a row a method."""
    seeds = max(mean.seeds for mean in means.values())
    table = Table(title=f"Errors at the end, means of {seeds} drives", box=None)
    table.add_column("method")
    for name in ("mm", "degrees", "rms mm", "NEES", "tracking", "ms", "prototype"):
        table.add_column(name, justify="right")
    for scenario in scenarios:
        table.add_row(f"[bold]{SCENARIOS[scenario].words}[/bold]")
        for method in methods:
            mean = means[scenario, method]
            table.add_row(
                f"  {method}",
                f"{mean.mm:.1f}",
                f"{mean.degrees:.3f}",
                f"{mean.rms_mm:.1f}",
                f"{mean.nees:.1f}",
                f"{mean.tracking:.0%}",
                f"{mean.ms:.2f}",
                PROTOTYPE.get(method, {}).get(scenario, ""),
            )
    return table


def explanation(methods: Sequence[str]) -> str:
    """What the rows are."""
    rows = "; ".join(f"{name}: {METHODS[name].words}" for name in methods)
    return f"{rows}. Prototype: SPEC 1.7, mm / degrees (NEES), in worlds of its own."
