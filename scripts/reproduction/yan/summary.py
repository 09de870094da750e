"""What the paper says and what was asked of us, beside what came out: the top of the page."""

from typing import NamedTuple

from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Cell, Number, Row, Table, Verdict
from grouser.scripts.reproduction.yan.forms import CORRECTED
from grouser.scripts.reproduction.yan.observer_cases import TOLERANCE


class _Claim(NamedTuple):
    """A figure that shall lie between two numbers; None where there is no limit."""

    words: str
    figure: str
    low: float | None
    high: float | None
    digits: int | None
    """After the point; None for a number next to zero, which gets a power of ten."""
    paper: str | None = None
    """Name of the paper's own number."""
    printed: str | None = None
    """Name of the same of the printed form."""


def _of_world(world: str, words: str) -> tuple[_Claim, ...]:
    ours, printed = f"{world}.{CORRECTED}", f"{world}.printed"
    return (
        _Claim(f"{words}: position error, RMS m", f"{ours}.rms_m", None, 0.35, 3,
               printed=f"{printed}.rms_m"),
        _Claim(f"{words}: at the end, m", f"{ours}.final_m", None, 0.2, 3,
               printed=f"{printed}.final_m"),
        _Claim(f"{words}: NEES", f"{ours}.nees", 2.0, 4.5, 2, printed=f"{printed}.nees"),
        _Claim(f"{words}: lines in the map", f"{ours}.landmarks", 4.0, 4.3, 2,
               printed=f"{printed}.landmarks"),
        _Claim(f"{words}: error of a line's r, m", f"{ours}.line_r_m", None, 0.5, 3,
               printed=f"{printed}.line_r_m"),
        _Claim(f"{words}: error of a line's alpha, deg", f"{ours}.line_alpha_deg", None, 1.5, 3,
               printed=f"{printed}.line_alpha_deg"),
        _Claim(f"{words}: wrong associations in all drives", f"{ours}.wrong_associations", None,
               0.0, 0, printed=f"{printed}.wrong_associations"),
    )  # fmt: skip


_COMPILED, _INTERPRETED = "table1.compiled.alone", "table1.interpreted.alone"
_CLAIMS = (
    *_of_world("normal", "normal run"),
    *_of_world("over_range", "over-range run"),
    _Claim("lines in a scan, normal run: position error, RMS m", "normal.scan.rms_m", None, 0.2, 3),
    _Claim("lines in a scan, normal run: wrong associations in all drives",
           "normal.scan.wrong_associations", None, 0.0, 0),
    _Claim("right end of line 3, over-range, m", "over_range_end_m", 53.8, 54.8, 2,
           paper="paper.over_range_end_m", printed="end.over_range.printed_m"),
    _Claim("its largest of all drives, m", f"end.over_range.{CORRECTED}_largest_m", None, 59.0, 2,
           printed="end.over_range.printed_largest_m"),
    _Claim("right end without noise, m", "noise_free_end_m", 54.156, 54.176, 3),
    _Claim("right end of line 3, normal, m", f"end.normal.{CORRECTED}_m", 45.0, 46.0, 2,
           printed="end.normal.printed_m"),
    _Claim("Jacobians from finite differences", "errata.worst_jacobian", None, 1e-6, None),
    _Claim("bisection: visible or not, mistakes", "observer.mismatches", None, 0.0, 0),
    _Claim("bisection: farthest from the closed form, m", "observer.worst_m", None, TOLERANCE, 5),
    _Claim("point by point at 0.1 m over bisection", f"{_COMPILED}.points_0_1_over_bisection",
           10.0, None, 1, paper="paper.table1.ratio"),
    _Claim("the same, interpreted", f"{_INTERPRETED}.points_0_1_over_bisection", 10.0, None, 1),
    _Claim("point by point at 0.5 m over bisection, interpreted",
           f"{_INTERPRETED}.points_0_5_over_bisection", 3.0, None, 1),
    _Claim("bisection over the closed form", f"{_COMPILED}.bisection_over_closed", 3.0, None, 1),
)  # fmt: skip


_WRONG = (
    f"normal.{CORRECTED}.wrong_associations",
    f"over_range.{CORRECTED}.wrong_associations",
    "normal.scan.wrong_associations",
    "normal.scan-lidar.wrong_associations",
)
"""Of our filter, whatever it sees lines by, in either world."""


def summary_figures(figures: Figures) -> Figures:
    """What was asked, and for every row whether it holds: 1 or 0; and the names by which a reader
    of results.json asks first."""
    told: Figures = {
        "rms_m": figures[f"normal.{CORRECTED}.rms_m"],
        "nees": figures[f"normal.{CORRECTED}.nees"],
        "lines": figures[f"normal.{CORRECTED}.landmarks"],
        "wrong_associations": sum(figures[name] or 0.0 for name in _WRONG),
    }
    verdicts = []
    for claim in _CLAIMS:
        told[f"asked.least.{claim.figure}"] = claim.low
        told[f"asked.most.{claim.figure}"] = claim.high
        verdicts.append(_holds(claim, figures[claim.figure]))
        told[f"verdict.{claim.figure}"] = verdicts[-1]
    told["summary.rows"] = float(len(verdicts))
    told["summary.reached"] = float(sum(verdict or 0.0 for verdict in verdicts))
    return told


def summary_table() -> Table:
    """A row a claim."""
    return Table(
        "Reached: within what was asked. {summary.reached:.0f} of {summary.rows:.0f} rows are.",
        ["claim", "the paper", "asked", "ours", "ours, (6) and (7) as printed", "verdict"],
        [_row(claim) for claim in _CLAIMS],
        paper_columns=(1,),
    )


def _row(claim: _Claim) -> Row:
    return Row(
        claim.words,
        [
            "" if claim.paper is None else _number(claim, claim.paper),
            _asked(claim),
            _number(claim, claim.figure),
            "" if claim.printed is None else _number(claim, claim.printed),
            Verdict(f"verdict.{claim.figure}"),
        ],
    )


def _number(claim: _Claim, key: str) -> Number:
    if claim.digits is None:
        return Number(key, 0, scientific=True)
    return Number(key, claim.digits)


def _asked(claim: _Claim) -> Cell:
    least = _number(claim, f"asked.least.{claim.figure}")
    most = _number(claim, f"asked.most.{claim.figure}")
    if claim.low is None:
        return ("at most ", most)
    if claim.high is None:
        return ("at least ", least)
    return (least, " to ", most)


def _holds(claim: _Claim, value: float | None) -> float | None:
    if value is None:
        return None
    above = claim.low is None or value >= claim.low
    return float(above and (claim.high is None or value <= claim.high))
