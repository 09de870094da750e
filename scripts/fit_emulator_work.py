"""What `grouser fit-emulator` does: read runs, fit to most of them, compare with the others."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from grouser.estimators.emulation.agreement import MEASURES, Agreement, agreement
from grouser.estimators.emulation.fit import fit_error_model
from grouser.estimators.emulation.model_file import save_model
from grouser.estimators.emulation.plot import draw
from grouser.estimators.emulation.record import Record
from grouser.estimators.evaluation.folder import read_json, write_json
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.estimators.evaluation.results import ResultsFolder, RunTrajectories
from grouser.estimators.registry import TRUTH_READERS
from grouser.scripts.fit_emulator import FitEmulator
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors

_FEWEST_RUNS = 3
_SEED = 0


@dataclass(frozen=True, slots=True)
class _Data:
    """The runs of an estimator: every third is held out from the fit."""

    name: str
    records: Sequence[Record]

    @property
    def fitted(self) -> list[Record]:
        return [record for k, record in enumerate(self.records) if k % 3 != 2]

    @property
    def held_out(self) -> list[Record]:
        return [record for k, record in enumerate(self.records) if k % 3 == 2]


def fit_emulators(options: FitEmulator) -> int:
    """Fit, compare, print the table, and return the exit code."""
    with usage_errors():
        if not options.no_plots:
            require_matplotlib()
        data = _read(options)
        options.output.mkdir(parents=True, exist_ok=True)
    source = ", ".join(_described(folder) for folder in options.results)
    agreements: dict[str, Agreement] = {}
    with progress("", len(data)) as bar:
        for each in bar.over(data):
            bar.describe(each.name)
            agreements[each.name] = _fit(each, source, options)
    distances = {name: found.distances() for name, found in agreements.items()}
    write_json(options.output / "agreement.json", distances)
    console = table_console()
    console.print(_table(distances, data))
    console.print(f"{len(data)} emulators in {options.output}: NAME.json, agreement.json")
    return 0


def _fit(data: _Data, source: str, options: FitEmulator) -> Agreement:
    model = fit_error_model(data.fitted, of=data.name, source=source)
    save_model(options.output / f"{_file_stem(data.name)}.json", model)
    found = agreement(model, data.held_out, seed=_SEED)
    if not options.no_plots:
        title = f"{data.name}: {len(data.held_out)} runs that were held out, and emulated ones"
        draw(found, title).savefig(options.output / f"{_file_stem(data.name)}.png", dpi=120)
    return found


def _file_stem(name: str) -> str:
    return name.replace("/", "-")


def _read(options: FitEmulator) -> list[_Data]:
    runs = [run for folder in options.results for run in _runs(folder)]
    there = sorted({run.estimator for run in runs} - TRUTH_READERS)
    missing = [name for name in options.estimators if name not in there]
    if missing:
        raise UsageError(f"the results hold no {missing[0]!r} to emulate; they hold: {there}")
    data = []
    for name in options.estimators or there:
        records = [Record.of(run) for run in runs if run.estimator == name]
        if len(records) < _FEWEST_RUNS:
            raise UsageError(
                f"{name!r} has {len(records)} runs; at least {_FEWEST_RUNS} are needed, one of "
                "which is held out: compare with more --seeds"
            )
        data.append(_Data(name, records))
    return data


def _runs(folder: Path) -> list[RunTrajectories]:
    return ResultsFolder(folder, _settings(folder), resume=True).trajectories()


def _settings(folder: Path) -> dict[str, Any]:
    if not (folder / "settings.json").is_file():
        raise UsageError(f"{folder} holds no results; `grouser compare --output {folder}` does")
    settings: dict[str, Any] = read_json(folder / "settings.json", dict)
    return settings


def _described(folder: Path) -> str:
    """Where a folder's runs were, in words."""
    settings = _settings(folder)
    return " ".join(f"{key}={value}" for key, value in settings.items() if value is not None)


def _table(distances: dict[str, dict[str, float]], data: Sequence[_Data]) -> Table:
    table = Table(
        title="Quantile distance of emulated and real errors on runs that were held out\n"
        "(mean over quantiles, as a share of the real ones' mean; 0 is alike)"
    )
    table.add_column("estimator", no_wrap=True)
    for name in ("runs", *MEASURES):
        table.add_column(name.replace("_", " "), justify="right")
    for each in data:
        shown = [f"{value:.2f}" for value in distances[each.name].values()]
        table.add_row(each.name, str(len(each.records)), *shown)
    return table
