"""The crews of a vector: the caller's own, and those in processes that it started."""

import multiprocessing
import time
from collections.abc import Callable, Sequence
from ctypes import c_byte
from typing import Any

from gymnasium.vector import AutoresetMode

from grouser.envs.fleet.crew import Crew, Maker
from grouser.envs.fleet.page import PageFormat
from grouser.envs.fleet.shares import environments, keeping_to, n_crews, processors
from grouser.envs.fleet.worker import Worker


class Team:
    """All environments of a vector, each in one of a few crews. One piece of work at a time.

    Args:
        makers: of the environments; they are called in the processes that step them.
        page_format: of what they show.
        context: how processes start; None for the system's usual way.
        mode: when an environment whose episode ended is reset.
        caller_steps: whether the calling process has a crew, too.
    """

    def __init__(
        self,
        makers: Sequence[Maker],
        page_format: PageFormat,
        *,
        context: str | None,
        mode: AutoresetMode,
        caller_steps: bool,
    ) -> None:
        ctx = multiprocessing.get_context(context)
        memory = ctx.RawArray(c_byte, page_format.n_bytes)
        self.page = page_format.shared(memory)
        of = n_crews(len(makers))
        envs = [environments(index, of, len(makers)) for index in range(of)]
        shares = [processors(index, of) for index in range(of)]
        hired = range(1 if caller_steps else 0, of)
        self._workers = {
            envs[index]: Worker(
                ctx, makers[_slice(envs[index])], envs[index].start, memory, page_format, mode,
                shares[index],
            )
            for index in hired
        }  # fmt: skip
        self._own_envs = envs[0] if caller_steps else range(0)
        self._share = shares[0] if caller_steps else frozenset[int]()
        with keeping_to(self._share):
            self._own = Crew(makers[_slice(self._own_envs)], 0, self.page, mode)
        self._begun: tuple[str, Sequence[Any]] | None = None
        self._own_answer: list[Any] | Exception | None = None

    @property
    def processes(self) -> list[Any]:
        """Those that were started."""
        return [worker.process for worker in self._workers.values()]

    def begin(self, method: str, arguments: Callable[[slice], Sequence[Any]]) -> None:
        """Have every crew do something.

        Args:
            method: of `Crew`.
            arguments: for some of the environments.
        """
        for envs, worker in self._workers.items():
            worker.send(method, *arguments(_slice(envs)))
        self._begun = method, arguments(_slice(self._own_envs))

    def end(self, timeout: float | None = None) -> list[Any]:
        """Do the caller's own share, and wait for the others; what each environment gave.

        Raises:
            multiprocessing.TimeoutError: some are not ready after so many
                seconds; they may be waited for again.
            RuntimeError: a process has ended.
            Exception: what an environment raised.
        """
        until = None if timeout is None else time.monotonic() + timeout
        if self._own_answer is None:
            self._own_answer = self._own_work()
        if until is not None:
            self._wait(until)
        answers = [self._own_answer, *(_answer(worker) for worker in self._workers.values())]
        self._begun = self._own_answer = None
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
        return [given for answer in answers for given in answer or ()]

    def _wait(self, until: float) -> None:
        for worker in self._workers.values():
            if not worker.has_answered(max(until - time.monotonic(), 0)):
                raise multiprocessing.TimeoutError("not all environments were ready in time")

    def close(self) -> None:
        """End all processes once they have done what they are doing."""
        self._own.close()
        for worker in self._workers.values():
            worker.close()

    def terminate(self) -> None:
        """End all processes at once."""
        self._own.close()
        for worker in self._workers.values():
            worker.terminate()

    def _own_work(self) -> list[Any] | Exception:
        assert self._begun is not None, "begin() comes first"
        method, arguments = self._begun
        try:
            with keeping_to(self._share):
                return list(getattr(self._own, method)(*arguments))
        except Exception as error:
            return error


def _answer(worker: Worker) -> Any:
    try:
        return worker.answer()
    except Exception as error:
        return error


def _slice(envs: range) -> slice:
    return slice(envs.start, envs.stop)
