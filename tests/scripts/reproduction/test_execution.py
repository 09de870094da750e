"""Experiments are kept as they are done: a run that was killed goes on, and ends the same."""

import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from grouser.scripts.reproduction.execution import execute
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.store import ExperimentStore

SETTINGS = {"paper": "none", "sizes": (1, 2)}


@dataclass(frozen=True)
class Draw(Experiment):
    """Numbers that its name decides; or a failure."""

    name: str = ""
    parts: int = 2
    measures_time: bool = False
    fails: bool = False

    def run(self, on_part: OnPart) -> Outcome:
        if self.fails:
            raise RuntimeError("a bug")
        for _ in range(self.parts):
            on_part()
        values = np.random.default_rng(list(self.name.encode())).normal(size=5)
        return {"values": values, "words": np.array(["a", "b"])}


@dataclass
class Watch:
    begun: list[str]
    parts: int = 0

    def count(self, parts: int) -> None:
        self.parts += parts


def run(experiments: list[Draw], store: ExperimentStore, jobs: int) -> Watch:
    watch = Watch([])
    missing = [e for e in experiments if not store.has(e.name)]
    store.begin()
    execute(missing, store, jobs=jobs, on_experiment=watch.begun.append, on_parts=watch.count)
    return watch


def test_one_process_or_two_keep_the_same(tmp_path: Path) -> None:
    experiments = [Draw("a"), Draw("b", 3), Draw("timed", 1, measures_time=True), Draw("c")]
    kept = {}
    for jobs in (1, 2):
        store = ExperimentStore(tmp_path / str(jobs), SETTINGS, resume=False)
        watch = run(experiments, store, jobs)
        assert watch.begun[0] == "timed", "what measures time comes first"
        assert sorted(watch.begun) == ["a", "b", "c", "timed"] and watch.parts == 8
        kept[jobs] = {e.name: store.read(e.name)["values"] for e in experiments}
    for name, values in kept[1].items():
        np.testing.assert_array_equal(values, kept[2][name])


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_was_done_before_a_failure_is_kept_and_not_done_again(
    tmp_path: Path, jobs: int
) -> None:
    store = ExperimentStore(tmp_path, SETTINGS, resume=False)
    broken = [Draw("a", 9), Draw("b", 1, fails=True)]
    with pytest.raises(RuntimeError, match="a bug"):
        run(broken[:1], store, jobs)
        run(broken, store, jobs)
    again = ExperimentStore(tmp_path, SETTINGS, resume=True)
    assert again.has("a") and not again.has("b")
    assert run([Draw("a", 9), Draw("b", 1)], again, jobs).begun == ["b"]


SLOW = """
import sys, time
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_execution import Draw, SETTINGS, run
from grouser.scripts.reproduction.store import ExperimentStore

class Slow(Draw):
    def run(self, on_part):
        time.sleep(0.3 if self.name == "a" else 60)
        return super().run(on_part)

if __name__ == "__main__":
    run([Slow("a"), Slow("b")], ExperimentStore(Path({folder!r}), SETTINGS, resume=False), 2)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no SIGKILL on this system")
def test_a_killed_run_leaves_no_workers_and_goes_on(tmp_path: Path) -> None:
    script, folder = tmp_path / "slow.py", tmp_path / "kept"
    script.write_text(SLOW.format(tests=str(Path(__file__).parent), folder=str(folder)))
    process = subprocess.Popen([sys.executable, str(script)], stderr=subprocess.PIPE)
    first, deadline = folder / "experiments" / "a.npz", time.monotonic() + 30
    while not first.exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)
    process.kill()
    # The workers hold stderr open as long as they live.
    process.communicate(timeout=20)
    store = ExperimentStore(folder, SETTINGS, resume=True)
    assert store.has("a") and not store.has("b")
    assert run([Draw("a"), Draw("b")], store, 1).begun == ["b"]
    fresh = ExperimentStore(tmp_path / "fresh", SETTINGS, resume=False)
    run([Draw("a"), Draw("b")], fresh, 1)
    for name in ("a", "b"):
        np.testing.assert_array_equal(store.read(name)["values"], fresh.read(name)["values"])


def test_a_folder_is_not_mixed_up(tmp_path: Path) -> None:
    store = ExperimentStore(tmp_path, SETTINGS, resume=False)
    store.begin()
    store.keep("a", {"x": np.zeros(2)})
    assert not list(tmp_path.rglob("*.partial"))
    with pytest.raises(ValueError, match="already holds experiments; give --resume to go on"):
        ExperimentStore(tmp_path, SETTINGS, resume=False)
    with pytest.raises(ValueError, match=r"was begun with other settings: paper 'none' \(now 'x'"):
        ExperimentStore(tmp_path, {**SETTINGS, "paper": "x"}, resume=True)


def test_a_damaged_experiment_says_what_to_do(tmp_path: Path) -> None:
    store = ExperimentStore(tmp_path, SETTINGS, resume=False)
    store.begin()
    store.keep("a", {"x": np.zeros(2)})
    path = tmp_path / "experiments" / "a.npz"
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(ValueError, match="delete it, and --resume does it again"):
        store.read("a")


def test_a_place_that_cannot_be_written_to_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="is not a folder that you may write to"):
        ExperimentStore(tmp_path / "file" / "results", SETTINGS, resume=False)
