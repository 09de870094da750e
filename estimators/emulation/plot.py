"""The picture of an emulator: distributions of its errors beside those of the real estimator."""

from typing import Any

import numpy as np

from grouser.estimators.emulation.agreement import MEASURES, Agreement
from grouser.geometry import Array


def draw(agreement: Agreement, title: str) -> Any:
    """A matplotlib figure: for each measure the share of samples below a value, both ways."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 6.5), layout="constrained")
    for axes, (measure, words) in zip(figure.subplots(2, 3).flat, MEASURES.items(), strict=True):
        axes.plot(*_cumulated(agreement.real[measure]), color="black", label="real")
        axes.plot(*_cumulated(agreement.emulated[measure]), color="#D55E00", label="emulated")
        axes.set(xlabel=words, ylabel="share of samples", ylim=(0, 1), xlim=(0, None))
        axes.set_title(f"quantile distance {agreement.distance(measure):.2f}", fontsize="medium")
        axes.grid(alpha=0.3)
    figure.axes[0].legend()
    figure.suptitle(title)
    return figure


def _cumulated(samples: Array) -> tuple[Array, Array]:
    shares = np.linspace(0, 1, 201)
    return np.quantile(samples, shares), shares
