"""One comparison of a picture with a predicted state, and what it says of the motion."""

from dataclasses import dataclass
from enum import Enum, auto

from grouser.estimators.monocular.robust_update import Updated
from grouser.estimators.monocular.search import Sighting
from grouser.estimators.visual.fusion import SLIP_GATE

FEWEST = 8
"""Points that must agree, or the picture tells nothing."""


@dataclass(frozen=True, slots=True)
class Look:
    """A predicted state, compared with a picture."""

    sought: int
    """Points that should be in view."""
    sighting: Sighting
    updated: Updated

    @property
    def agreeing(self) -> int:
        """Points that agree on a motion."""
        return int(self.updated.inliers.sum())

    def supported(self, share: float) -> bool:
        """Whether so many of the points that should be in view are found and agree.

        Where a camera looks from is told by all of its points. If another one looks, those far off
        agree on a turn that never was, and no sigma tells; but the near ones are not found.
        """
        return self.agreeing >= max(FEWEST, share * self.sought)

    def expected(self, share: float) -> bool:
        """Whether they agree on a motion such as was predicted."""
        return self.supported(share) and self.updated.nis <= SLIP_GATE


class Verdict(Enum):
    """What a picture says of the motion."""

    AS_PREDICTED = auto()
    SLIPPED = auto()
    """Another than the tracks say."""
    STANDS = auto()
    """None, where the tracks say one."""
    NOTHING = auto()


def told_of(look: Look, verdict: Verdict) -> dict[str, float]:
    """For the diagnostics."""
    updated = look.updated
    return {
        "sought": float(look.sought),
        "matches": float(len(look.sighting.seen)),
        "inliers": float(updated.inliers.sum()),
        "rescued": float(updated.rescued.sum()),
        "trials": float(updated.trials),
        "nis": updated.nis,
        "slipped": float(verdict is Verdict.SLIPPED),
        "stands_still": float(verdict is Verdict.STANDS),
    }
