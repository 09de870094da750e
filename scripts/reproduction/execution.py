"""The work of a reproduction: every missing experiment is done and kept, by several processes."""

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from multiprocessing.queues import SimpleQueue
from typing import Any

import cv2

from grouser.scripts.reproduction.experiment import Experiment
from grouser.scripts.reproduction.store import ExperimentStore
from grouser.scripts.worker import set_up_worker

OnExperiment = Callable[[str], None]
"""Called with the name of an experiment that begins."""

OnParts = Callable[[int], None]
"""Called with the number of parts that were done since the last call."""

_POLL = 0.2  # s


def execute(
    experiments: Sequence[Experiment],
    store: ExperimentStore,
    *,
    jobs: int,
    on_experiment: OnExperiment,
    on_parts: OnParts,
) -> None:
    """Do the experiments, each on disk as soon as it is done: first those that measure time, one
    after another, then the others by so many processes at once."""
    timed = [e for e in experiments if e.measures_time]
    others = [e for e in experiments if not e.measures_time]
    alone, together = (timed, others) if jobs > 1 else (timed + others, [])
    _one_after_another(alone, store, on_experiment, on_parts)
    if together:
        _at_once(together, store, jobs, on_experiment, on_parts)


def _one_after_another(
    experiments: Sequence[Experiment],
    store: ExperimentStore,
    on_experiment: OnExperiment,
    on_parts: OnParts,
) -> None:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        for experiment in experiments:
            on_experiment(experiment.name)
            store.keep(experiment.name, experiment.run(lambda: on_parts(1)))
    finally:
        cv2.setNumThreads(threads)


def _at_once(
    experiments: Sequence[Experiment],
    store: ExperimentStore,
    jobs: int,
    on_experiment: OnExperiment,
    on_parts: OnParts,
) -> None:
    context = get_context("spawn")  # a fork would take the threads of OpenCV and numba with it
    parts: SimpleQueue[str | None] = context.SimpleQueue()
    setup = (context.Value("i", 0), jobs, parts)
    with ProcessPoolExecutor(jobs, context, initializer=_set_up, initargs=setup) as pool:
        # The longest first, so that none of them is begun when the others are done.
        longest_first = sorted(experiments, key=lambda e: e.parts, reverse=True)
        left = {pool.submit(_do, experiment, store) for experiment in longest_first}
        try:
            while left:
                done, left = wait(left, timeout=_POLL, return_when=FIRST_COMPLETED)
                _tell(parts, on_experiment, on_parts)
                _raise_any(done)
        except BaseException:
            _stop(pool)
            raise


def _tell(parts: Any, on_experiment: OnExperiment, on_parts: OnParts) -> None:
    count = 0
    while not parts.empty():
        begun = parts.get()
        if begun is None:
            count += 1
        else:
            on_experiment(begun)
    if count:
        on_parts(count)


def _raise_any(done: set[Future[None]]) -> None:
    for future in done:
        future.result()


def _stop(pool: ProcessPoolExecutor) -> None:
    """End the workers at once: what they are at is done again by --resume."""
    workers = list(pool._processes.values())
    pool.shutdown(wait=False, cancel_futures=True)
    for worker in workers:
        worker.terminate()


_parts: Any = None
"""Of a worker: where it says that an experiment begins (its name) or a part is done (None)."""


def _set_up(started: Any, jobs: int, parts: Any) -> None:
    global _parts
    _parts = parts
    set_up_worker(started, jobs)


def _do(experiment: Experiment, store: ExperimentStore) -> None:
    _parts.put(experiment.name)
    store.keep(experiment.name, experiment.run(lambda: _parts.put(None)))
