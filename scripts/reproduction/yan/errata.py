"""The paper's equations as printed and as corrected, side by side, computed at run time."""

from dataclasses import dataclass

import numpy as np

from grouser.scripts.reproduction.errata_table import Erratum, errata_table
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Paragraph, Section
from grouser.scripts.reproduction.yan import errata_motion, errata_observer, errata_sight
from grouser.scripts.reproduction.yan.drives import line_world, rig_of

NAME = "errata"
_SEED = 0


@dataclass(frozen=True, slots=True)
class ErrataExperiment(Experiment):
    """Every row of the table that no drive is needed for, from a generator of its own."""

    points: int
    """States at which Jacobians are compared; of the rest, a hundred times as many."""
    name: str = NAME

    def run(self, on_part: OnPart) -> Outcome:
        """One number a name."""
        rng, points, many = np.random.default_rng(_SEED), self.points, 100 * self.points
        rig = rig_of(line_world("yan-normal"))
        assert rig.steering is not None
        values = {
            **errata_motion.axle(rig.steering),
            **errata_motion.motion_jacobians(rng, rig, points),
            **errata_sight.bearings(rng, many),
            **errata_sight.point_jacobians(rng, points),
            **errata_sight.line_jacobians(rng, points),
            **errata_sight.distances(rng, many),
            **errata_sight.foot_information(),
            **errata_sight.near_origin(),
            **errata_observer.visible_set(rng, many),
            **errata_observer.longer_half(rng, points),
        }
        on_part()
        return {name: np.array(value) for name, value in values.items()}


def errata_figures(outcome: Outcome) -> Figures:
    """What was computed, and the largest of the filter's Jacobians' errors."""
    values = {name: float(value) for name, value in outcome.items()}
    ours = ("eq6.corrected", "eq7.corrected", "eq11.corrected", "lines.jacobian")
    values["worst_jacobian"] = max(values[name] for name in ours)
    return named("errata", values)


_ERRATA = (
    Erratum("(5)", "sideways speed of the rear wheels, m/s; (x, y) of the rear or the front axle",
            "errata.eq5.rear_m_s", "errata.eq5.front_m_s", 2,
            "right of the front axle, with the front wheel's speed"),
    Erratum("(6)", "from finite differences, largest", "errata.eq6.printed",
            "errata.eq6.corrected", None, "row 2: + T V cos"),
    Erratum("(7)", "from finite differences, largest", "errata.eq7.printed",
            "errata.eq7.corrected", None, "row 2, speed: + T sin"),
    Erratum("(6), (7)", "NEES of the filter in the normal run, 3 is honest",
            "normal.printed.nees", "normal.corrected.nees", 1, "the heading leads astray"),
    Erratum("(6), (7)", "its position error, RMS m", "normal.printed.rms_m",
            "normal.corrected.rms_m", 3, ""),
    Erratum("(10)", "largest error of a bearing, rad", "errata.eq10.printed_rad",
            "errata.eq10.corrected_rad", 2, "atan2, and innovations wrapped"),
    Erratum("(11)", "row 1 and the pose's part, from finite differences",
            "errata.eq11.pose_and_row_1", None, None, "right"),
    Erratum("(11)", "row 2, the landmark's part, from finite differences", "errata.eq11.printed",
            "errata.eq11.corrected", None, "(+ dy, - dx) over the squared distance"),
    Erratum("(11)", "NEES of a filter of foot points that a sensor reports",
            "normal.points-printed-11.nees", "normal.points.nees", 1, ""),
    Erratum("(13)", "mean of D squared of a line seen again, 2 is honest", "errata.eq13.printed",
            "errata.eq13.corrected", 2, "V is the innovation's covariance H P H' + R"),
    Erratum("(13)", "seen again and taken for another line, %",
            "errata.eq13.printed_refused_percent", "errata.eq13.corrected_refused_percent", 1,
            "gate at 9.21; a part of 99 % should pass"),
    Erratum("1.3", "information on the way along a line, 1/m^2, of one sight",
            "errata.foot.printed", "errata.foot.corrected", 1,
            "the foot is found by the pose: it says nothing of the way along the line"),
    Erratum("1.3", "NEES in the normal run: with such feet, and with (r, alpha)",
            "normal.estimated-feet.nees", "normal.corrected.nees", 1,
            "believed, it makes the filter too sure"),
    Erratum("1.3", "landmarks in the map, of four lines", "normal.estimated-feet.landmarks",
            "normal.corrected.landmarks", 1, "and lines are taken for new ones"),
    Erratum("1.3", "largest derivative of (r, alpha) by the foot, 0.07 m from the origin",
            "errata.foot.singular", None, 1, "singular at r = 0; (r, alpha) is not"),
    Erratum("2", "visible points in the set that is called observable, %",
            "errata.set.printed_percent", "errata.set.corrected_percent", 0,
            "F > 0 is what lies beyond the range"),
    Erratum("2", "worst visible length, m: Fig. 4 for a foot on either side, or the longer half",
            "errata.half.printed_m", "errata.half.corrected_m", 3,
            "the sentence on the left side is a copy of that on Fig. 3"),
    Erratum("3", "right end of line 3 in the normal run, m: as listed, or as in Fig. 6",
            "true_end.over_range_m", "true_end.normal_m", 0,
            "the list has 60, of the over-range run; only the right end grows"),
    Erratum("3", "right end in the over-range run, m: printed, and visible without noise",
            "paper.over_range_end_m", "noise_free_end_m", 4, "one noisy run"),
)  # fmt: skip


def errata_section() -> Section:
    """The table."""
    return Section(
        "Errata",
        [
            Paragraph(
                "Equations of the paper as printed, against finite differences, simulation and "
                "the forms that this repository uses, whose own code is asked. Where the "
                "corrected column is empty, the printed form is right, or there is nothing in its "
                "place."
            ),
            errata_table(_ERRATA),
        ],
    )
