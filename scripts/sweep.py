"""A sweep: many runs that do not need one another, done by processes here or on a Ray cluster.

Every run brings all that it needs, its seed included, so that the results do not depend on who did
them. Runs of a worker that was killed are done again.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TypeVar

from grouser.scripts.ray_cluster import run_on_ray
from grouser.scripts.worker import set_up_worker

JobT = TypeVar("JobT")
ResultT = TypeVar("ResultT")

ATTEMPTS = 3
"""How often workers may be killed while no run is finished, before it is given up."""


def sweep(
    work: Callable[[JobT], ResultT],
    jobs: Sequence[JobT],
    *,
    processes: int = 1,
    ray: str | None = None,
) -> Iterator[tuple[int, ResultT]]:
    """The number of each run and its result, as they are done, in no order.

    Args:
        work: does one run; a function of a module, which other processes can import.
        jobs: what `work` is given, one a run.
        processes: how many work at once on this machine; 1 is this process alone.
        ray: address of a Ray cluster that does the work instead, such as "auto" or
            "10.0.0.1:6379"; grouser is installed on each of its nodes.

    Raises:
        ImportError: ray was asked for and is not installed.
        ConnectionError: there is no Ray cluster at that address.
        RuntimeError: workers were killed again and again.
    """
    if ray is not None:
        yield from run_on_ray(work, jobs, ray)
    elif processes == 1:
        yield from ((number, work(job)) for number, job in enumerate(jobs))
    else:
        yield from _run_here(work, jobs, processes)


def in_order(done: Iterator[tuple[int, ResultT]]) -> Iterator[ResultT]:
    """The results of a sweep in the order of its runs, each as soon as those before it are done."""
    waiting: dict[int, ResultT] = {}
    following = 0
    for number, result in done:
        waiting[number] = result
        while following in waiting:
            yield waiting.pop(following)
            following += 1


def _run_here(
    work: Callable[[JobT], ResultT], jobs: Sequence[JobT], processes: int
) -> Iterator[tuple[int, ResultT]]:
    left, attempts = set(range(len(jobs))), 0
    while left:
        if attempts == ATTEMPTS:
            raise RuntimeError(
                f"workers were killed {ATTEMPTS} times before they finished a run, for want of "
                f"memory perhaps; {len(left)} of {len(jobs)} runs are left. "
                "Try again with fewer processes"
            )
        attempts += 1
        try:
            for number, result in _pool(work, jobs, sorted(left), processes):
                left.remove(number)
                attempts = 0
                yield number, result
        except BrokenProcessPool:
            continue


def _pool(
    work: Callable[[JobT], ResultT], jobs: Sequence[JobT], numbers: Sequence[int], processes: int
) -> Iterator[tuple[int, ResultT]]:
    context = get_context("spawn")  # a fork would take the threads of OpenCV and numba with it
    workers = min(processes, len(numbers))
    setup = (context.Value("i", 0), workers)
    pool = ProcessPoolExecutor(workers, context, initializer=set_up_worker, initargs=setup)
    try:
        submitted = {pool.submit(work, jobs[number]): number for number in numbers}
        for future in as_completed(submitted):
            yield submitted[future], future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
