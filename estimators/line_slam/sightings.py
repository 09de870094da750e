"""How often each line of the map was seen: what was seen once may be no line of the world."""

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_whole


class Sightings:
    """Of n lines, in the order of the filter's. A line is confirmed once it was seen again; one
    that is not, within so many scans, is to be forgotten (SPEC 2.6)."""

    def __init__(self, patience: int) -> None:
        """patience: scans that a line seen once is kept."""
        self.patience = patience
        require_whole(self, "patience")
        self.counts = np.zeros(0, dtype=np.int64)
        """(n,) scans that showed it."""
        self._first = np.zeros(0, dtype=np.int64)
        self._scan = 0

    def next_scan(self) -> None:
        """Another scan is looked at."""
        self._scan += 1

    def add(self, count: int = 1) -> None:
        """A new last line, seen so often."""
        self.counts = np.append(self.counts, count)
        self._first = np.append(self._first, self._scan)

    def again(self, lines: NDArray[np.intp]) -> None:
        """These were seen in this scan; more than once counts once."""
        self.counts[lines] += 1

    def join(self, kept: int, gone: int) -> None:
        """Two lines are one."""
        self.counts[kept] += self.counts[gone]
        self.forget(gone)

    def forget(self, line: int) -> None:
        """Those behind it move up."""
        self.counts = np.delete(self.counts, line)
        self._first = np.delete(self._first, line)

    def doubtful(self) -> NDArray[np.intp]:
        """Lines to be forgotten, the last first."""
        old = self._scan - self._first >= self.patience
        return np.nonzero((self.counts == 1) & old)[0][::-1]
