"""The runs of a sweep as tasks of a Ray cluster."""

import socket
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType
from typing import TypeVar

import cv2

JobT = TypeVar("JobT")
ResultT = TypeVar("ResultT")

_RETRIES = 3
_PATIENCE = 5.0  # s


def run_on_ray(
    work: Callable[[JobT], ResultT], jobs: Sequence[JobT], address: str
) -> Iterator[tuple[int, ResultT]]:
    """The number of each run and its result, as they are done. Ray does the runs of a worker or a
    node that died again, up to three times.

    Raises:
        ImportError: Ray is not installed.
        ConnectionError: there is no cluster at the address.
    """
    ray = require_cluster(address)
    try:
        task = ray.remote(num_cpus=1, max_retries=_RETRIES)(_do)
        numbers = {task.remote(work, job): number for number, job in enumerate(jobs)}
        left = list(numbers)
        while left:
            (done,), left = ray.wait(left, num_returns=1)
            yield numbers[done], ray.get(done)
    finally:
        ray.shutdown()


def require_cluster(address: str) -> ModuleType:
    """Ray, connected to the cluster: before anything else is begun.

    Raises:
        ImportError: Ray is not installed.
        ConnectionError: there is no cluster at the address.
    """
    ray = _import_ray()
    if not ray.is_initialized():
        _require_listener(address)
        try:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except (ConnectionError, ValueError) as error:
            raise ConnectionError(_no_cluster(address)) from error
    return ray


def _do(work: Callable[[JobT], ResultT], job: JobT) -> ResultT:
    cv2.setNumThreads(1)
    return work(job)


def _import_ray() -> ModuleType:
    try:
        import ray
    except ImportError as error:
        raise ImportError(
            'Ray is not installed, and --ray needs it: pip install "grouser[ray]", here and on '
            "every node of the cluster"
        ) from error
    assert isinstance(ray, ModuleType)
    return ray


def _require_listener(address: str) -> None:
    """Ray itself would wait for minutes and then end this process."""
    host, separator, port = address.removeprefix("ray://").rpartition(":")
    if not separator or not port.isdigit():
        return  # "auto" or "local", or what Ray will complain of
    try:
        socket.create_connection((host, int(port)), timeout=_PATIENCE).close()
    except OSError as error:
        raise ConnectionError(_no_cluster(address)) from error


def _no_cluster(address: str) -> str:
    return (
        f"there is no Ray cluster at {address!r}; start one with `ray start --head`, and give the "
        "address that it tells, or 'auto' on the same machine"
    )
