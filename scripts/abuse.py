"""`grouser abuse`: what estimators make of sensors that go wrong for a while."""

from dataclasses import dataclass
from typing import Annotated

import tyro


@dataclass(frozen=True)
class Abuse:
    """Spoil what the simulated robot senses for three seconds, and see what estimators make of it.

    Images go black, white, dark, blurred, saturated, frozen or change eyes; tracks fall silent,
    stick or read zero. The table has the frames of that while by status (all drives together), by
    what the sigma of the place grew, how many frames later it tracked again, and the share of the
    frames that track, over the whole drive, in which the pose is off by more than 4 sigma.

    Some to try:

    grouser abuse

    grouser abuse --estimators vo-imu-gps five-point-ransac --spoils frozen "tracks silent"
    """

    estimators: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = (
        "one-point-ransac",
    )
    """Registered names."""
    spoils: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ()
    """By name; all of them when left out. A wrong name lists those that there are."""
    seeds: int = 3
    """Drives, each in another yard."""

    def run(self) -> int:
        """Drive, spoil, print, and return the exit code."""
        from grouser.scripts.abuse_work import abuse  # help and misspellings need not wait

        return abuse(self)
