"""Grouser's speed, measured: `python scripts/benchmark.py`. Compare ratios; times are a machine's.

Figures that are ratios compare both sides in the same run, taking turns.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from grouser.scripts import (
    benchmark_environment,
    benchmark_images,
    benchmark_line_slam,
    benchmark_montecarlo,
    benchmark_odometry,
    benchmark_slip,
    benchmark_training,
    benchmark_vector,
)
from grouser.scripts.benchmark_timing import Figures, NotAvailable

_MEASUREMENTS = (
    *benchmark_odometry.MEASUREMENTS,
    *benchmark_environment.MEASUREMENTS,
    *benchmark_images.MEASUREMENTS,
    *benchmark_vector.MEASUREMENTS,
    *benchmark_montecarlo.MEASUREMENTS,
    *benchmark_line_slam.MEASUREMENTS,
    *benchmark_slip.MEASUREMENTS,
    *benchmark_training.MEASUREMENTS,
)


@dataclass(frozen=True)
class Benchmark:
    """Measure how fast Grouser is on this machine.

    Some to try:

    python scripts/benchmark.py

    python scripts/benchmark.py --only odometry --output figures.json

    python scripts/benchmark.py --only environment.raster_over_naive
    """

    only: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """One figure, or those of one part, such as odometry or environment. All when left out."""
    output: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """JSON file for the figures: name to value and unit."""

    def run(self) -> int:
        """Measure, print and write; returns the exit code."""
        problem = self._problem()
        if problem:
            print(f"benchmark: error: {problem}", file=sys.stderr)
            return 2
        figures = measure(_wanted(self.only))
        Console().print(_table(figures))
        if self.output is not None:
            self.output.write_text(json.dumps(_plain(figures), indent=2) + "\n")
        return 0

    def _problem(self) -> str | None:
        if not _wanted(self.only):
            names = _wanted(None)
            parts = dict.fromkeys(name.partition(".")[0] for name in names)
            known = ", ".join([*parts, *names])
            return f"there is no figure {self.only!r}; there are: {known}"
        if self.output is not None and not self.output.absolute().parent.is_dir():
            return f"--output: there is no folder {self.output.absolute().parent}; make it first"
        return None


def _wanted(only: str | None) -> list[str]:
    """Names of the figures that are, or belong to, what was asked for."""
    names = [name for measurement in _MEASUREMENTS for name in measurement.gives]
    return [n for n in names if only is None or n == only or n.startswith(f"{only}.")]


def measure(wanted: list[str]) -> Figures:
    """The wanted figures, from the measurements that give any of them; one that this machine
    cannot measure is left out, and the terminal says why."""
    needed = [m for m in _MEASUREMENTS if set(m.gives) & set(wanted)]
    figures: Figures = {}
    errors = Console(stderr=True)
    for measurement in track(needed, "measuring", console=errors, disable=not errors.is_terminal):
        try:
            figures |= measurement.measure()
        except NotAvailable as error:
            errors.print(f"{', '.join(measurement.gives)}: not measured: {error}")
    return {name: figures[name] for name in wanted if name in figures}


def _plain(figures: Figures) -> dict[str, dict[str, float | str]]:
    return {name: {"value": value, "unit": unit} for name, (value, unit) in figures.items()}


def _table(figures: Figures) -> Table:
    table = Table("figure", "value", "unit", box=None)
    table.columns[1].justify = "right"
    for name, (value, unit) in figures.items():
        table.add_row(name, f"{value:.4g}", unit)
    return table


def main() -> int:
    """The command line."""
    return tyro.cli(Benchmark, prog="benchmark.py").run()


if __name__ == "__main__":
    sys.exit(main())
