"""Scores of an evaluation as a table for the terminal."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from grouser.agents.evaluation import Contrast, Gap, Score

_COLUMNS: tuple[tuple[str, Callable[[Score], str]], ...] = (
    ("ok\n%", lambda s: f"{100 * s.success:.0f}"),
    ("SPL", lambda s: f"{s.spl:.3f}"),
    ("95 %", lambda s: f"{s.spl_low:.2f}..{s.spl_high:.2f}"),
    ("soft\nSPL", lambda s: f"{s.soft_spl:.3f}"),
    ("hit\n%", lambda s: f"{100 * s.collisions:.0f}"),
    ("miss\n%", lambda s: f"{100 * s.missed:.0f}"),
    ("late\n%", lambda s: f"{100 * s.timeouts:.0f}"),
    ("time\ns", lambda s: f"{s.time_s:.0f}"),
    ("goal\nm", lambda s: f"{s.distance_to_goal_m:.2f}"),
    ("belief\nm", lambda s: f"{s.believed_distance_to_goal_m:.2f}"),
    ("price", lambda s: f"{s.price_of_estimation:+.3f}"),
    ("95 %", lambda s: f"{s.price_low:+.2f}..{s.price_high:+.2f}"),
)
_SPARED = ("soft\nSPL", "time\ns", "belief\nm")
"""Left out where a column for drivers needs their room."""


def score_table(scores: Sequence[Score], title: str) -> Table:
    """A row for every driver and estimator."""
    with_driver = len({s.policy for s in scores}) > 1
    with_latency = len({s.pose_latency for s in scores}) > 1
    wide = with_driver or with_latency
    columns = [c for c in _COLUMNS if not (wide and c[0] in _SPARED)]
    far = "goal: how far" if wide else "goal, belief: how far, truly and as the robot believes,"
    table = Table(
        title=title,
        caption=f"{far} the goal is in the end;\nprice: SPL under the true pose minus SPL under "
        "the estimator, in the same episodes",
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=0,
    )
    names = short_names([s.policy for s in scores])
    if with_driver:
        table.add_column("driver", no_wrap=True)
    table.add_column("estimator", overflow="fold")
    if with_latency:
        table.add_column("late\ns", justify="right", no_wrap=True)
    for heading, _ in columns:
        table.add_column(heading, justify="right", no_wrap=True)
    for s in scores:
        cells = [cell(s) for _, cell in columns]
        driver = [names[s.policy]] if with_driver else []
        latency = [f"{s.pose_latency:g}"] if with_latency else []
        table.add_row(*driver, s.estimator, *latency, *cells)
    return table


def short_names(policies: Sequence[str]) -> dict[str, str]:
    """Drivers' names for a table: of a file its folder's, where several have the same."""
    files = {name: Path(name) for name in policies}
    alike = [path.name for path in files.values()]
    return {
        name: path.parent.name if alike.count(path.name) > 1 and path.parent.name else path.name
        for name, path in files.items()
    }


def contrast_words(contrast: Contrast, names: Mapping[str, str]) -> str:
    """A line on what a driver gains over the first one, by their `short_names`."""
    late = f", {contrast.pose_latency:g} s late" if contrast.pose_latency else ""
    return (
        f"{names[contrast.policy]} over {names[contrast.against]}, {contrast.estimator}{late}: SPL "
        f"{contrast.spl_gain:+.3f} ({contrast.spl_gain_low:+.3f} .. {contrast.spl_gain_high:+.3f})"
        f", success {contrast.success_gain:+.3f} ({contrast.success_gain_low:+.3f} .. "
        f"{contrast.success_gain_high:+.3f})"
    )


def gap_words(gap: Gap) -> str:
    """A few lines on the open-closed gap."""
    late = f", {gap.pose_latency:g} s late" if gap.pose_latency else ""
    tau = "none, for all are equal" if gap.kendall_tau is None else f"{gap.kendall_tau:+.2f}"
    return (
        f"{gap.policy}{late}: Kendall's tau between both orders {tau}\n"
        f"  by error on a replayed drive: {', '.join(gap.by_ate)}\n"
        f"  by SPL in the loop:           {', '.join(gap.by_spl)}"
    )
