"""Errors, honesty and maps of all forms in both worlds: what the paper shows by pictures alone."""

from collections.abc import Mapping

import numpy as np

from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Cell, Number, Paragraph, Row, Section, Table
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS, RIVALS, Form
from grouser.scripts.reproduction.yan.monte_carlo import MonteCarlo, blocks
from grouser.scripts.reproduction.yan.paper import WORLDS
from grouser.scripts.reproduction.yan.scale import Scale

CONTESTANTS = {"normal": FORMS | RIVALS, "over_range": FORMS}
"""By world."""

_WORDS = {"normal": "in the normal run", "over_range": "in the over-range run"}


def contest_name(world: str) -> str:
    """The label of a world's drives."""
    return f"forms-{WORLDS[world]}"


def contest_experiments(scale: Scale) -> list[MonteCarlo]:
    """The start is known exactly, as in the paper."""
    return [
        block
        for world in WORLDS
        for block in blocks(contest_name(world), WORLDS[world], CONTESTANTS[world], scale.runs)
    ]


def contest_figures(outcomes: Outcomes) -> Figures:
    """Means over the runs."""
    figures: Figures = {}
    for world in WORLDS:
        outcome = outcomes[contest_name(world)]
        for name, form in CONTESTANTS[world].items():
            figures |= named(f"{world}.{name}", _values(outcome, name, form))
    return figures


def contest_section(figures: Figures) -> Section:
    """A table a world."""
    return Section(
        "Errors, honesty and maps",
        [
            Paragraph(
                "{monte_carlo.runs:.0f} drives a world, each with noise of its own; the same bits "
                "for all rows. Errors are root mean squares over a drive, averaged over drives. "
                "NEES is the pose's squared error over its covariance, after every look of the "
                "sensor; an honest filter has 3 on average. NIS is the same of the lines that "
                "were seen, 2 for each; a gate at 9.21 cuts it to 1.91. Lines that the map "
                "has are compared with the nearest that there is; there are 4. A foot point is "
                "that of the world's origin on a line, by which the paper names a line; a sensor "
                "that reports it sees what the paper's equations describe, and no lidar does. "
                "An association is wrong where a line that was seen corrected another one of the "
                "map, in all drives together."
            ),
            *(_table(world, figures) for world in reversed(WORLDS)),
        ],
    )


def _values(outcome: Outcome, name: str, form: Form) -> Mapping[str, float]:
    of = {
        key.removeprefix(f"{name}."): v for key, v in outcome.items() if key.startswith(f"{name}.")
    }
    values = {
        "rms_m": float(of["rms"].mean()),
        "rms_median_m": float(np.median(of["rms"])),
        "rms_largest_m": float(of["rms"].max()),
        "heading_rms_deg": float(np.degrees(of["heading_rms"].mean())),
        "final_m": float(of["final"].mean()),
        "nees": float(np.nanmean(of["nees"])),
    }
    if form.sees is None:
        return values
    values["nis"] = float(of["nis_sum"].sum() / of["matched"].sum())
    values["landmarks"] = float(of["landmarks"].mean())
    if "line_r" in of:
        values["line_r_m"] = float(of["line_r"].mean())
        values["line_alpha_deg"] = float(np.degrees(of["line_alpha"].mean()))
    if "wrong" in of:
        values["associations"] = float(of["associations"].sum())
        values["wrong_associations"] = float(of["wrong"].sum())
    return values


_COLUMNS = {
    "rms_m": ("position, RMS m", 3),
    "rms_median_m": ("its median", 3),
    "rms_largest_m": ("its largest", 3),
    "heading_rms_deg": ("heading, RMS deg", 2),
    "final_m": ("at the end, m", 3),
    "nees": ("NEES", 2),
    "nis": ("NIS", 2),
    "landmarks": ("landmarks", 2),
    "line_r_m": ("a line's r, m", 3),
    "line_alpha_deg": ("its alpha, deg", 2),
    "wrong_associations": ("wrong associations", 0),
}


def _table(world: str, figures: Figures) -> Table:
    rows = []
    for name, form in CONTESTANTS[world].items():
        keys = {key: f"{world}.{name}.{key}" for key in _COLUMNS}
        cells: list[Cell] = [
            Number(keys[key], digits) if keys[key] in figures else ""
            for key, (_, digits) in _COLUMNS.items()
        ]
        rows.append(Row(form.words, cells, stressed=name == CORRECTED))
    headings = ["", *(heading for heading, _ in _COLUMNS.values())]
    return Table(f"Forms of the filter {_WORDS[world]}.", headings, rows)
