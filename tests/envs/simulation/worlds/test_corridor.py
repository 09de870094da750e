"""Corridors: there is always a way around, and passages may be closed without cutting any off."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grouser.envs.simulation.worlds.passages import all_passages, spare_passages
from grouser.envs.simulation.worlds.reachability import free_space, reachable
from grouser.envs.simulation.worlds.registry import make_world


def loops(seed: int, difficulty: float) -> int:
    """Around how many things of at least the size of a block the robot can drive."""
    world = make_world("corridor", np.random.default_rng(seed), difficulty=difficulty)
    way = reachable(free_space(world), world.start[:2])
    rest = (~way.free).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(rest, connectivity=8)
    islands = stats[1:][(stats[1:, cv2.CC_STAT_LEFT] > 0) & (stats[1:, cv2.CC_STAT_TOP] > 0)]
    return int(np.sum(islands[:, cv2.CC_STAT_AREA] * way.cell**2 > 8.0))


@pytest.mark.parametrize("seed", range(40))
def test_there_is_always_a_loop_and_fewer_the_harder(seed: int) -> None:
    assert loops(seed, 1.0) == 1
    assert loops(seed, 0.0) == 6


@given(columns=st.integers(1, 4), rows=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_all_crossings_stay_connected_without_the_spare_passages(
    columns: int, rows: int, seed: int
) -> None:
    spare = spare_passages(np.random.default_rng(seed), columns, rows)
    assert len(spare) == len(set(spare)) == columns * rows
    kept = [passage for passage in all_passages(columns, rows) if passage not in spare]
    reached = {(0, 0)}
    for _ in kept:
        reached |= {end for passage in kept if set(passage.ends) & reached for end in passage.ends}
    assert len(reached) == (columns + 1) * (rows + 1)
