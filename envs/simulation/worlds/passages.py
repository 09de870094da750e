"""Passages between blocks on a grid, as a graph: which of them may be walled up."""

from typing import NamedTuple

import numpy as np


class Passage(NamedTuple):
    """From the crossing (column, row) to the next one along x (axis 0) or y (axis 1)."""

    column: int
    row: int
    axis: int

    @property
    def ends(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """The two crossings."""
        here = (self.column, self.row)
        return here, (self.column + (self.axis == 0), self.row + (self.axis == 1))


def all_passages(columns: int, rows: int) -> list[Passage]:
    """Those around columns x rows blocks, between (columns + 1) x (rows + 1) crossings."""
    along_x = [Passage(i, j, 0) for j in range(rows + 1) for i in range(columns)]
    along_y = [Passage(i, j, 1) for j in range(rows) for i in range(columns + 1)]
    return along_x + along_y


def spare_passages(rng: np.random.Generator, columns: int, rows: int) -> list[Passage]:
    """One passage a block without which all crossings are still connected, in random order.

    They are what a random spanning tree leaves over (Kruskal 1956): each that stays open makes a
    loop.
    """
    every = all_passages(columns, rows)
    shuffled = [every[k] for k in rng.permutation(len(every))]
    component = {end: end for passage in every for end in passage.ends}
    spare = []
    for passage in shuffled:
        here, there = (component[end] for end in passage.ends)
        if here == there:
            spare.append(passage)
        for end, its in component.items():
            if its == there:
                component[end] = here
    return spare
