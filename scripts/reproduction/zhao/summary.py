"""What the paper claims and what was asked of us, beside what came out: the top of the page."""

from collections.abc import Sequence
from dataclasses import dataclass

from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Cell, Number, Row, Table, Verdict
from grouser.scripts.reproduction.zhao.contenders import PAPER_FORM, RECOMMENDED
from grouser.scripts.reproduction.zhao.error_tables import average_cell
from grouser.scripts.reproduction.zhao.errors import AXES, UNITS

LINEAR_MM, TURN_DEG, FREE_PERCENT, FREE_DEG = 30.0, 0.5, 0.5, 0.5
"""Asked: position error of linear motion on average, heading error of a turn of 360 degrees,
errors at the end of free motion."""
GROWTH_MB = 5.0
"""Of memory in the long run: what allocators take before they settle."""

_FREE = ("free_indoors", "free_outdoors_1", "free_outdoors_2", "free_outdoors_3")
_LINEAR = ("linear_indoors", "linear_outdoors")
_SPOT = ("spot_turn_asphalt", "spot_turn_cement")


@dataclass(frozen=True, slots=True)
class _Comparison:
    """Averages of ours that shall be no farther from zero than the paper's."""

    words: str
    kind: str
    axes: tuple[str, ...]

    @property
    def names(self) -> list[str]:
        return [f"{axis}_average_{UNITS[AXES.index(axis)]}" for axis in self.axes]

    def cell(self, prefix: str) -> Cell:
        """All axes, one after another."""
        parts: list[str | Number] = []
        for axis in self.axes:
            parts += ["; " if parts else "", *average_cell(prefix, axis)]
        return tuple(parts)


@dataclass(frozen=True, slots=True)
class _Limit:
    """A figure of ours that shall be no larger than the paper's, or than what was asked."""

    words: str
    figure: str
    """With {} for the estimator's name where it has one."""
    limit: str
    """The figure's name."""
    digits: int
    from_paper: bool


_COMPARISONS = (
    _Comparison("linear motion indoors: x; y, mm", "linear_indoors", ("x", "y")),
    _Comparison("linear motion outdoors: x; y, mm", "linear_outdoors", ("x", "y")),
    _Comparison("spot turns on asphalt: heading, deg", "spot_turn_asphalt", ("heading",)),
    _Comparison("spot turns on cement: heading, deg", "spot_turn_cement", ("heading",)),
    _Comparison("free motion indoors: x; y, mm; heading, deg", "free_indoors", AXES),
    _Comparison("free motion outdoors, set 1", "free_outdoors_1", AXES),
    _Comparison("free motion outdoors, set 2", "free_outdoors_2", AXES),
    _Comparison("free motion outdoors, set 3", "free_outdoors_3", AXES),
)

_AT_320 = "timing.320x240"
_LIMITS = (
    _Limit("stereo processing at 320 x 240, ms", f"{_AT_320}.{{}}.stereo_ms",
           f"paper.{_AT_320}.stereo_ms", 2, True),
    _Limit("parameter estimation at 320 x 240, ms", f"{_AT_320}.{{}}.estimation_ms",
           f"paper.{_AT_320}.estimation_ms", 3, True),
    _Limit("Kalman filter at 320 x 240, ms", f"{_AT_320}.{{}}.filter_ms",
           f"paper.{_AT_320}.filter_ms", 3, True),
    _Limit("long run: mean time, ms", "stability.mean_ms", "paper.stability.mean_ms", 2, True),
    _Limit("long run: standard deviation, ms", "stability.deviation_ms",
           "paper.stability.deviation_ms", 2, True),
    _Limit("long run: growth of memory, MB", "stability.growth_mb", "asked.growth_mb", 1, False),
    *(_Limit(f"{kind.replace('_', ' ')}: position error on average, mm",
             f"{kind}.{{}}.position_mean_mm", "asked.linear_mm", 1, False) for kind in _LINEAR),
    *(_Limit(f"{kind.replace('_', ' ')}: error after 360 degrees, deg",
             f"{kind}.{{}}.first_turn_deg", "asked.turn_deg", 2, False) for kind in _SPOT),
    *(_Limit(f"{kind.replace('_', ' ')}: position at the end, % of the way",
             f"{kind}.{{}}.position_end_percent", "asked.free_percent", 2, False)
      for kind in _FREE),
    *(_Limit(f"{kind.replace('_', ' ')}: heading at the end, deg",
             f"{kind}.{{}}.heading_end_deg", "asked.free_deg", 2, False) for kind in _FREE),
)  # fmt: skip


def summary_figures(figures: Figures) -> Figures:
    """What was asked, and for every row whether it holds: 1 or 0."""
    told: Figures = {
        "asked.linear_mm": LINEAR_MM,
        "asked.turn_deg": TURN_DEG,
        "asked.free_percent": FREE_PERCENT,
        "asked.free_deg": FREE_DEG,
        "asked.growth_mb": GROWTH_MB,
    }
    for comparison in _COMPARISONS:
        ours, paper = f"{comparison.kind}.{RECOMMENDED}", f"paper.{comparison.kind}"
        pairs = [(figures[f"{ours}.{n}"], figures[f"{paper}.{n}"]) for n in comparison.names]
        told[f"verdict.{comparison.kind}"] = _all_at_most(pairs)
    for limit in _LIMITS:
        ours = limit.figure.format(RECOMMENDED)
        bound = (figures | told)[limit.limit]
        told[f"verdict.{_short(limit)}"] = _all_at_most([(figures[ours], bound)])
    verdicts = [value for key, value in told.items() if key.startswith("verdict.")]
    told["summary.rows"] = float(len(verdicts))
    told["summary.reached"] = float(sum(value or 0.0 for value in verdicts))
    return told


def summary_table(names: Sequence[str]) -> Table:
    """A row a claim."""
    has_paper_form = PAPER_FORM in names
    columns = ["claim", "the paper, or asked", "ours, recommended form"]
    columns += ["ours, paper's form"] if has_paper_form else []
    rows = []
    for limit in _LIMITS:
        bound = Number(limit.limit, limit.digits)
        cells: list[Cell] = [bound if limit.from_paper else ("asked: ", bound)]
        cells.append(Number(limit.figure.format(RECOMMENDED), limit.digits))
        if has_paper_form:
            of_form = "{}" in limit.figure
            cells.append(Number(limit.figure.format(PAPER_FORM), limit.digits) if of_form else "")
        rows.append(Row(limit.words, [*cells, Verdict(f"verdict.{_short(limit)}")]))
    for comparison in _COMPARISONS:
        kind = comparison.kind
        cells = [comparison.cell(f"paper.{kind}"), comparison.cell(f"{kind}.{RECOMMENDED}")]
        cells += [comparison.cell(f"{kind}.{PAPER_FORM}")] if has_paper_form else []
        rows.append(Row(comparison.words, [*cells, Verdict(f"verdict.{kind}")]))
    return Table(
        "Reached: no larger than what was asked, or than the paper's; signed averages are compared "
        "by their size. {summary.reached:.0f} of {summary.rows:.0f} rows are.",
        [*columns, "verdict"],
        rows,
        paper_columns=(1,),
    )


def _short(limit: _Limit) -> str:
    return limit.figure.replace(".{}", "")


def _all_at_most(pairs: Sequence[tuple[float | None, float | None]]) -> float | None:
    """1 where every first is known and no farther from zero than its second."""
    values = [(abs(ours), abs(bound)) for ours, bound in pairs if ours is not None and bound]
    if len(values) < len(pairs):
        return None
    return float(all(ours <= bound for ours, bound in values))
