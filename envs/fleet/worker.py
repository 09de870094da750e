"""A process with a crew, and what its maker holds of it.

Both ends send pairs through a pipe: a method of the crew and its arguments; then whether that went
well, and what it gave.
"""

import pickle
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from typing import Any

from gymnasium.vector import AutoresetMode

from grouser.envs.fleet.crew import Crew, Maker
from grouser.envs.fleet.page import PageFormat
from grouser.envs.fleet.shares import keeping_to

_CLOSE = "close"
_SPIN = 5e-4
"""So long a process looks for a message again and again before it sleeps, s: longer than a vector
that is stepped in a loop takes from one step to the next, for to wake another process and to be
woken costs as much as a tenth of a step, and a process has its processor for itself."""


class WorkerError(Exception):
    """What happened in a process: the cause of an error that its maker raises again."""

    def __str__(self) -> str:
        return f'\n"""\n{self.args[0]}"""'


class Worker:
    """The maker's end of a process with a crew.

    Args:
        context: how processes start.
        makers: of the crew's environments.
        first: index of the first of them in the vector.
        memory: shared, of the vector's page.
        page_format: how the page is laid out in it.
        mode: when an environment whose episode ended is reset.
        share: processors that it keeps to; all when empty.
    """

    def __init__(
        self,
        context: BaseContext,
        makers: Sequence[Maker],
        first: int,
        memory: Any,
        page_format: PageFormat,
        mode: AutoresetMode,
        share: frozenset[int],
    ) -> None:
        self._pipe, its_end = context.Pipe()
        self.process = context.Process(  # type: ignore[attr-defined]
            target=_work,
            name=f"Grouser-{first}",
            args=(makers, first, memory, page_format, mode, share, its_end, self._pipe),
            daemon=True,
        )
        self.process.start()
        its_end.close()

    def send(self, method: str, *arguments: Any) -> None:
        """Have the crew do something; where the process has ended, `answer` says so."""
        with suppress(BrokenPipeError, ConnectionResetError):
            _send(self._pipe, (method, arguments))

    def has_answered(self, timeout: float) -> bool:
        """Whether an answer is there within a time, s."""
        return self._pipe.poll(timeout)

    def answer(self) -> Any:
        """What the crew gave, waited for.

        Raises:
            RuntimeError: the process has ended.
            Exception: what the crew raised; its cause has the process's traceback.
        """
        try:
            went_well, given = _received(self._pipe)
        except (EOFError, ConnectionResetError):
            raise self._lost() from None
        if not went_well:
            error, trace = given
            raise error from WorkerError(trace)
        return given

    def close(self) -> None:
        """End the process, when it has done what it is doing."""
        self.send(_CLOSE)
        self._pipe.close()
        self.process.join()

    def terminate(self) -> None:
        """End the process at once."""
        self.process.terminate()
        self._pipe.close()
        self.process.join()

    def _lost(self) -> RuntimeError:
        self.process.join(1)
        return RuntimeError(
            f"the process {self.process.pid} of {self.process.name} has ended (exit code "
            f"{self.process.exitcode}), and its environments with it; close this vector and make "
            "a new one"
        )


def _work(
    makers: Sequence[Maker],
    first: int,
    memory: Any,
    page_format: PageFormat,
    mode: AutoresetMode,
    share: frozenset[int],
    pipe: Connection,
    makers_end: Connection,
) -> None:
    """Do what is asked until asked to close, or until nobody is there to ask."""
    makers_end.close()  # or this process would not notice that its maker is gone
    with keeping_to(share):
        crew = None
        try:
            crew = Crew(makers, first, page_format.shared(memory), mode)
            while (asked := _received(pipe))[0] != _CLOSE:
                _send(pipe, _done(crew, *asked))
        except (EOFError, ConnectionResetError, BrokenPipeError, KeyboardInterrupt):
            pass
        except Exception as error:  # its making failed: the first answer says so
            _send(pipe, (False, _portable(error)))
        finally:
            if crew is not None:
                crew.close()


def _received(pipe: Connection) -> Any:
    """The next message, waited for awake first and asleep then."""
    awake_until = time.monotonic() + _SPIN
    while not pipe.poll(0) and time.monotonic() < awake_until:
        pass
    return pickle.loads(pipe.recv_bytes())


def _send(pipe: Connection, message: Any) -> None:
    """At half the cost of the pipe's own `send`, which can also hand on pipes and locks."""
    pipe.send_bytes(pickle.dumps(message, pickle.HIGHEST_PROTOCOL))


def _done(crew: Crew, method: str, arguments: Sequence[Any]) -> tuple[bool, Any]:
    try:
        return True, getattr(crew, method)(*arguments)
    except Exception as error:
        return False, _portable(error)


def _portable(error: Exception) -> tuple[Exception, str]:
    """An error and its traceback as they get through a pipe."""
    trace = "".join(traceback.format_exception(type(error), error, error.__traceback__))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    return error, trace
