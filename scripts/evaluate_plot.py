"""The picture of a sweep of latencies: SPL over how late the pose arrives."""

from collections.abc import Sequence
from pathlib import Path

from grouser.agents.evaluation import Score
from grouser.scripts.evaluate_table import short_names

_APART = 4e-3
"""s between the bars of neighbours, so that all are seen."""


def plot_latencies(folder: Path, scores: Sequence[Score]) -> Path:
    """Write latency.png, with bars that hold 95 % of resamples, and return its path."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    names = short_names([s.policy for s in scores])
    lines = list(dict.fromkeys((s.policy, s.estimator) for s in scores))
    for index, line in enumerate(lines):
        mine = sorted(
            (s for s in scores if (s.policy, s.estimator) == line), key=lambda s: s.pose_latency
        )
        spl = [s.spl for s in mine]
        spread = [[s.spl - s.spl_low for s in mine], [s.spl_high - s.spl for s in mine]]
        shift = _APART * (index - (len(lines) - 1) / 2)
        late = [s.pose_latency + shift for s in mine]
        label = line[1] if len(names) == 1 else f"{names[line[0]]}, {line[1]}"
        axes.errorbar(late, spl, spread, marker="o", markersize=4, capsize=2, label=label)
    axes.set(xlabel="the pose arrives late by [s]", ylabel="SPL", ylim=(0, 1))
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    path = folder / "latency.png"
    figure.savefig(path, dpi=120)
    return path
