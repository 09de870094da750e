"""`grouser fit-emulator`: from a comparison, estimators whose errors are drawn instead of made."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class FitEmulator:
    """Fit models of estimators' errors to the runs of comparisons, to train under them.

    An emulator draws errors like its estimator's, at a thousandth of the work: drift with way and
    turn, covariance, loss and recovery. Two thirds of the runs are fitted to; with the others, at
    their true ways, the distributions of real and emulated errors are compared.

    Some to try:

    grouser compare --driver tour --steps 1000 --seeds 24 --output results/plain

    grouser fit-emulator --results results/plain --output results/emulators

    gym.make("grouser/GoalNav-v0", estimator="emulated",
    estimator_options={"of": "results/emulators/one-point-ransac.json"})
    """

    results: Annotated[tuple[Path, ...], option("DIR ...")]
    """Folders of `grouser compare`; the runs of all are taken together."""
    estimators: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """Estimators to emulate; all that the folders hold, but the truth, by default."""
    output: Annotated[Path, option("DIR")] = Path("results/emulators")
    """Folder for NAME.json, NAME.png and agreement.json, the quantile distances of each."""
    no_plots: bool = False
    """Do without the PNG plots of both distributions."""

    def run(self) -> int:
        """Fit, compare, print the table, and return the exit code."""
        from grouser.scripts.fit_emulator_work import fit_emulators  # help need not wait

        return fit_emulators(self)
