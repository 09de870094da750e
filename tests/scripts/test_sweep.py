"""Sweeps give the same results whoever does them, and do the runs of a killed worker again."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from grouser.scripts.cli import main
from grouser.scripts.ray_cluster import require_cluster
from grouser.scripts.sweep import ATTEMPTS, in_order, sweep
from tests.scripts.sweep_jobs import draw, kill, kill_the_first_time, refuse

SEEDS = range(6)
ALONE = [draw(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of two nodes of one processor each, on this machine."""
    pytest.importorskip("ray", reason='Ray is not installed: pip install "grouser[ray]"')
    from ray.cluster_utils import Cluster

    nodes = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
    )
    nodes.add_node(num_cpus=1)
    yield nodes.address
    nodes.shutdown()


@pytest.mark.parametrize("processes", [1, 2])
def test_processes_give_the_results_of_one(processes: int) -> None:
    assert list(in_order(sweep(draw, SEEDS, processes=processes))) == ALONE


def test_a_cluster_of_two_nodes_gives_the_results_of_one_process(cluster: str) -> None:
    ray = require_cluster(cluster)
    assert sum(node["Alive"] for node in ray.nodes()) == 2
    assert list(in_order(sweep(draw, SEEDS, ray=cluster))) == ALONE


def test_the_runs_of_a_killed_process_are_done_again(tmp_path: Path) -> None:
    jobs = [tmp_path / name for name in "abc"]
    done = list(in_order(sweep(kill_the_first_time, jobs, processes=2)))
    assert done == ["a", "b", "c"]


def test_the_runs_of_a_killed_worker_of_a_cluster_are_done_again(
    tmp_path: Path, cluster: str
) -> None:
    jobs = [tmp_path / name for name in "ab"]
    assert list(in_order(sweep(kill_the_first_time, jobs, ray=cluster))) == ["a", "b"]


def test_runs_that_kill_every_worker_are_given_up() -> None:
    with pytest.raises(RuntimeError, match=f"killed {ATTEMPTS} times before they finished a run"):
        list(sweep(kill, [0, 1], processes=2))


def test_an_error_of_a_run_is_raised_as_it_is(cluster: str) -> None:
    for where in ({"processes": 1}, {"processes": 2}, {"ray": cluster}):
        with pytest.raises(ValueError, match="run 7 cannot be done"):
            list(sweep(refuse, [7], **where))


def test_results_come_in_order_as_soon_as_they_can() -> None:
    taken: list[int] = []

    def done() -> Iterator[tuple[int, str]]:
        for number in (1, 0, 3, 2):
            taken.append(number)
            yield number, "abcd"[number]

    ordered = in_order(done())
    assert (next(ordered), next(ordered), taken) == ("a", "b", [1, 0])
    assert list(ordered) == ["c", "d"]


def test_a_cluster_that_is_not_there_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("ray", reason='Ray is not installed: pip install "grouser[ray]"')
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    assert main(["montecarlo", "--ray", address]) == 2
    words = f"there is no Ray cluster at '{address}'; start one with `ray start --head`"
    assert words in capsys.readouterr().err


def test_without_ray_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "ray", None)
    with pytest.raises(ImportError, match=r'pip install "grouser\[ray\]"'):
        require_cluster("auto")
