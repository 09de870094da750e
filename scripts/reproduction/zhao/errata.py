"""The paper's equations as printed and as corrected, side by side, computed at run time."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Number, Paragraph, Row, Section, Table
from grouser.scripts.reproduction.zhao import errata_tracks, errata_vision

NAME = "errata"
_SEED = 0


@dataclass(frozen=True, slots=True)
class ErrataExperiment(Experiment):
    """Every row of the table, from a generator of its own."""

    runs: int

    @property
    def name(self) -> str:
        return NAME

    @property
    def parts(self) -> int:
        return 1

    @property
    def measures_time(self) -> bool:
        return False

    def run(self, on_part: OnPart) -> Outcome:
        """One number a name."""
        rng, runs = np.random.default_rng(_SEED), self.runs
        values = {
            **errata_tracks.chords(),
            **errata_tracks.widths(),
            **errata_tracks.input_jacobian(),
            **errata_tracks.dead_reckoning_nees(rng, runs),
            **errata_vision.turn_errors(rng),
            **errata_vision.offset_error(rng),
            **errata_vision.turn_noise(rng, runs),
            **errata_vision.chord_errors(rng, runs),
            **errata_vision.ranges(rng),
            **errata_vision.rejections(rng, runs),
            **errata_vision.residuals(rng, runs),
        }
        on_part()
        return {name: np.array(value) for name, value in values.items()}


def errata_figures(outcome: Outcome) -> Figures:
    """What was computed."""
    return named("errata", {name: float(value) for name, value in outcome.items()})


class _Erratum(NamedTuple):
    """A row of the table."""

    equation: str
    measured: str
    printed: str
    corrected: str | None
    """None where the printed form is right."""
    digits: int | None
    """After the point; None for numbers next to zero, which get a power of ten."""
    says: str


_ERRATA = (
    _Erratum("(2), (3)", "way in a step of 1 rad, error in %", "eq2.printed_percent",
             "eq2.corrected_percent", 2, "the chord is shorter than the arc"),
    _Erratum("(4)", "turn over the true one, b the width of a track", "eq4.printed",
             "eq4.corrected", 3, "the divisor is D + b; D + 2b if b is half the width"),
    _Erratum("(9)", "NEES of dead reckoning, 3 is honest", "eq9.printed_nees",
             "eq9.corrected_nees", 1, "F = I forgets that a wrong heading leads astray"),
    _Erratum("(10)", "as Jacobian, from finite differences", "eq10.printed",
             "eq10.corrected", 3, "B depends on u by way of phi"),
    _Erratum("(12)", "error of the turn, camera above the track centre, rad",
             "eq12.error_rad", None, None, "right"),
    _Erratum("(14)", "the same", "eq14.error_rad", None, None, "right"),
    _Erratum("(14)", "the same at infinite depth", "eq14.at_infinity_rad", None, None, "right"),
    _Erratum("(14)", "turn too large, %, camera 0.2 m ahead, points 2 m away",
             "offset.printed_percent", "offset.corrected_percent", 2, "by a / z; SPEC 1.2"),
    _Erratum("(14)", "sigma of the turn, deg, a point 3 px below the horizon",
             "eq14.noise_printed_deg", "eq14.noise_corrected_deg", 2,
             "the disparity helps where the row does not"),
    _Erratum("(16)", "chord of 0.1 m, points 3.2 m away, m", "eq16.printed_m",
             "eq16.corrected_m", 2, "the sign of the second term"),
    _Erratum("(17)", "sigma of the chord, mm, at 2 m; sign mended", "eq17.at_2m_printed_mm",
             "eq17.at_2m_corrected_mm", 1, "the row tells more than two disparities"),
    _Erratum("(17)", "the same at 5 m", "eq17.at_5m_printed_mm", "eq17.at_5m_corrected_mm", 1, ""),
    _Erratum("(18)", "relative mismatch, d the disparity, or the range", "eq18.printed",
             "eq18.corrected", 3, "d is the horizontal range"),
    _Erratum("(20)", "good points rejected, %, 10 px below the horizon",
             "eq20.horizon_printed_percent", "eq20.horizon_corrected_percent", 0,
             "poles; the Sampson error has none"),
    _Erratum("(20)", "the same, 5 px beside the epipole", "eq20.epipole_printed_percent",
             "eq20.epipole_corrected_percent", 0, "threshold: 5 % rejected at (80, 80) px"),
    _Erratum("(21)", "residual of the true motion, m", "eq21.residual_m", None, None,
             "the sign is right"),
    _Erratum("(21)", "noise at 5 m over that at 1 m", "eq21.printed_times",
             "eq21.corrected_times", 1, "metres are not equally good; sigmas are"),
)  # fmt: skip


def errata_section() -> Section:
    """The table."""
    rows = []
    for erratum in _ERRATA:
        printed = _number(erratum, erratum.printed)
        corrected = "" if erratum.corrected is None else _number(erratum, erratum.corrected)
        rows.append(Row(erratum.equation, [erratum.measured, printed, corrected, erratum.says]))
    return Section(
        "Errata",
        [
            Paragraph(
                "Equations of the paper as printed, on synthetic points and tracks, against the "
                "forms that this repository uses. Where the corrected column is empty, the printed "
                "form is right."
            ),
            Table(
                "Printed and corrected forms, computed when this page was made.",
                ["equation", "what was measured", "printed", "corrected", "remark"],
                rows,
                paper_columns=(2,),
            ),
        ],
    )


def _number(erratum: _Erratum, name: str) -> Number:
    key = f"errata.{name}"
    return (
        Number(key, 0, scientific=True) if erratum.digits is None else Number(key, erratum.digits)
    )
