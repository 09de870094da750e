"""A saved robot goes on with the same bits, in the same instance, in another one, anywhere."""

import hashlib
import pickle
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grouser.envs.simulation.fast_dynamics import _advance
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.robot import DYNAMICS, RobotModel, TrackedRobot
from grouser.envs.simulation.surface import look_around
from grouser.envs.simulation.track_law import ground_wrench
from grouser.envs.simulation.world import join
from tests.envs.simulation.grounds import box, open_world, trunk

WORLD = open_world(
    solids=join(box(2.0, 0.4, (0.5, 3.0, 0.8), yaw=0.2), box(1.0, -1.2, (0.3, 0.3, 0.5))),
    cylinders=trunk(1.5, -0.6, 0.12),
    slabs=box(0.8, 0.0, (0.3, 1.5, 0.05), yaw=0.1),
)


def robot(dynamics: str) -> TrackedRobot:
    return TrackedRobot(RobotModel(), dt=0.1, dynamics=dynamics)


def go_on(one: TrackedRobot, n: int = 50) -> list[Motion]:
    """Into the wall, along it, and back."""
    return [one.step((0.5, 0.5 if k % 25 < 18 else -0.2)) for k in range(n)]


def digest(motions: Sequence[Motion]) -> str:
    total = hashlib.sha256()
    for m in motions:
        parts = (m.T_world_base, m.twist, m.track_speed, m.specific_force, m.angular_rate, m.path)
        for part in parts:
            total.update(np.ascontiguousarray(part).tobytes())
        total.update(bytes([m.contacts, m.collision]))
    return total.hexdigest()


def saved_at_the_wall(dynamics: str) -> tuple[TrackedRobot, Any]:
    one = robot(dynamics)
    one.enter(WORLD)
    for _ in range(80):
        if one.step((0.5, 0.45)).contacts:
            break
    one.step((0.5, 0.5))
    saved = one.save()
    assert one.step((0.5, 0.5)).contacts  # it is in contact, which is the hard case
    return one, saved


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_the_same_instance_goes_on_with_the_same_bits(dynamics: str) -> None:
    one, saved = saved_at_the_wall(dynamics)
    one.restore(saved, WORLD)
    first = go_on(one)
    assert sum(m.contacts > 0 for m in first) > 10
    one.restore(saved, WORLD)
    assert digest(go_on(one)) == digest(first)
    one.enter(open_world("mud", solids=box(0.6, 0, (0.3, 0.3, 0.3))))
    go_on(one)
    one.restore(saved, WORLD)
    assert digest(go_on(one)) == digest(first)
    one.close()


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_to_save_changes_nothing(dynamics: str) -> None:
    digests = set()
    for saving in (False, True):
        one = robot(dynamics)
        one.enter(WORLD)
        motions = []
        for _ in range(70):
            if saving:
                one.save()
            motions.append(one.step((0.5, 0.45)))
        digests.add(digest(motions))
        one.close()
    assert len(digests) == 1


_SCRIPT = """
import pickle, sys
from tests.envs.simulation.test_save import digest, go_on, robot
saved, world, dynamics = pickle.load(sys.stdin.buffer)
one = robot(dynamics)
one.restore(saved, world)
print(digest(go_on(one)))
"""


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_another_process_goes_on_with_the_same_bits(
    dynamics: str, pytestconfig: pytest.Config
) -> None:
    one, saved = saved_at_the_wall(dynamics)
    one.restore(saved, WORLD)
    expected = digest(go_on(one))
    one.close()
    run = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(pytestconfig.rootpath)!r})\n"
         + _SCRIPT],
        input=pickle.dumps((saved, WORLD, dynamics)), capture_output=True, check=True,
    )  # fmt: skip
    assert run.stdout.decode().split()[-1] == expected


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_what_was_saved_does_not_change_as_the_robot_drives_on(dynamics: str) -> None:
    one, saved = saved_at_the_wall(dynamics)
    before = pickle.dumps(saved)
    go_on(one, 5)
    one.restore(saved, WORLD)
    go_on(one, 5)
    assert pickle.dumps(saved) == before
    one.close()


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_thousands_of_saves_take_no_memory(dynamics: str) -> None:
    one, saved = saved_at_the_wall(dynamics)

    def save_and_restore(n: int) -> None:
        for _ in range(n):
            one.restore(one.save(), WORLD)
            one.step((0.5, 0.5))

    save_and_restore(300)
    before = _resident()
    save_and_restore(2000)
    assert _resident() - before < 2e6
    one.close()


def _resident() -> float:
    """Bytes of memory that this process has."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return float(pages * resource.getpagesize())


def test_a_robot_can_be_restored_that_never_entered_a_world() -> None:
    one, saved = saved_at_the_wall("fast")
    fresh = robot("fast")
    fresh.restore(saved, WORLD)
    one.restore(saved, WORLD)
    assert digest(go_on(fresh, 5)) == digest(go_on(one, 5))


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_a_world_that_was_pickled_has_nothing_compiled_anew(dynamics: str) -> None:
    """Its arrays may be written to, which for numba is another type."""
    one, saved = saved_at_the_wall(dynamics)
    before = _compiled()
    one.restore(saved, pickle.loads(pickle.dumps(WORLD)))
    one.step(np.array([0.5, 0.5]), traction=np.broadcast_to(1.0, 2))
    assert _compiled() == before > 0
    one.close()


def _compiled() -> int:
    return len(_advance.signatures) + len(ground_wrench.signatures) + len(look_around.signatures)
