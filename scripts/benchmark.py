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

from grouser.scripts import benchmark_environment, benchmark_odometry
from grouser.scripts.benchmark_timing import Figures

_BENCHMARKS = {**benchmark_odometry.BENCHMARKS, **benchmark_environment.BENCHMARKS}


@dataclass(frozen=True)
class Benchmark:
    """Measure how fast Grouser is on this machine.

    Some to try:

    python scripts/benchmark.py

    python scripts/benchmark.py --only odometry --output figures.json
    """

    only: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """One benchmark instead of all: odometry, environment, environment-without-images or
    environment-parts."""
    output: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """JSON file for the figures: name to value and unit."""

    def run(self) -> int:
        """Measure, print and write; returns the exit code."""
        problem = self._problem()
        if problem:
            print(f"benchmark: error: {problem}", file=sys.stderr)
            return 2
        figures = measure(list(_BENCHMARKS) if self.only is None else [self.only])
        Console().print(_table(figures))
        if self.output is not None:
            self.output.write_text(json.dumps(_plain(figures), indent=2) + "\n")
        return 0

    def _problem(self) -> str | None:
        if self.only is not None and self.only not in _BENCHMARKS:
            return f"there is no benchmark {self.only!r}; there are: {', '.join(_BENCHMARKS)}"
        if self.output is not None and not self.output.absolute().parent.is_dir():
            return f"--output: there is no folder {self.output.absolute().parent}; make it first"
        return None


def measure(names: list[str]) -> Figures:
    """The figures of the named benchmarks."""
    figures: Figures = {}
    errors = Console(stderr=True)
    for name in track(names, "benchmarks", console=errors, disable=not errors.is_terminal):
        figures |= _BENCHMARKS[name]()
    return figures


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
