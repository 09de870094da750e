"""The paper's equations as printed and as corrected, side by side, computed at run time."""

from dataclasses import dataclass

import numpy as np

from grouser.scripts.reproduction.errata_table import Erratum, errata_table
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Paragraph, Section
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


_ERRATA = (
    Erratum("(2), (3)", "way in a step of 1 rad, error in %", "errata.eq2.printed_percent",
            "errata.eq2.corrected_percent", 2, "the chord is shorter than the arc"),
    Erratum("(4)", "turn over the true one, b the width of a track", "errata.eq4.printed",
            "errata.eq4.corrected", 3, "the divisor is D + b; D + 2b if b is half the width"),
    Erratum("(9)", "NEES of dead reckoning, 3 is honest", "errata.eq9.printed_nees",
            "errata.eq9.corrected_nees", 1, "F = I forgets that a wrong heading leads astray"),
    Erratum("(10)", "as Jacobian, from finite differences", "errata.eq10.printed",
            "errata.eq10.corrected", 3, "B depends on u by way of phi"),
    Erratum("(12)", "error of the turn, camera above the track centre, rad",
            "errata.eq12.error_rad", None, None, "right"),
    Erratum("(14)", "the same", "errata.eq14.error_rad", None, None, "right"),
    Erratum("(14)", "the same at infinite depth", "errata.eq14.at_infinity_rad", None, None,
            "right"),
    Erratum("(14)", "turn too large, %, camera 0.2 m ahead, points 2 m away",
            "errata.offset.printed_percent", "errata.offset.corrected_percent", 2,
            "by a / z; SPEC 1.2"),
    Erratum("(14)", "sigma of the turn, deg, a point 3 px below the horizon",
            "errata.eq14.noise_printed_deg", "errata.eq14.noise_corrected_deg", 2,
            "the disparity helps where the row does not"),
    Erratum("(16)", "chord of 0.1 m, points 3.2 m away, m", "errata.eq16.printed_m",
            "errata.eq16.corrected_m", 2, "the sign of the second term"),
    Erratum("(17)", "sigma of the chord, mm, at 2 m; sign mended", "errata.eq17.at_2m_printed_mm",
            "errata.eq17.at_2m_corrected_mm", 1, "the row tells more than two disparities"),
    Erratum("(17)", "the same at 5 m", "errata.eq17.at_5m_printed_mm",
            "errata.eq17.at_5m_corrected_mm", 1, ""),
    Erratum("(18)", "relative mismatch, d the disparity, or the range", "errata.eq18.printed",
            "errata.eq18.corrected", 3, "d is the horizontal range"),
    Erratum("(20)", "good points rejected, %, 10 px below the horizon",
            "errata.eq20.horizon_printed_percent", "errata.eq20.horizon_corrected_percent", 0,
            "poles; the Sampson error has none"),
    Erratum("(20)", "the same, 5 px beside the epipole", "errata.eq20.epipole_printed_percent",
            "errata.eq20.epipole_corrected_percent", 0, "threshold: 5 % rejected at (80, 80) px"),
    Erratum("(21)", "residual of the true motion, m", "errata.eq21.residual_m", None, None,
            "the sign is right"),
    Erratum("(21)", "noise at 5 m over that at 1 m", "errata.eq21.printed_times",
            "errata.eq21.corrected_times", 1, "metres are not equally good; sigmas are"),
)  # fmt: skip


def errata_section() -> Section:
    """The table."""
    return Section(
        "Errata",
        [
            Paragraph(
                "Equations of the paper as printed, on synthetic points and tracks, against the "
                "forms that this repository uses. Where the corrected column is empty, the printed "
                "form is right."
            ),
            errata_table(_ERRATA),
        ],
    )
