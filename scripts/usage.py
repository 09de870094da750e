"""What a command refuses to do, as one line on the terminal instead of a traceback."""

from collections.abc import Iterator
from contextlib import contextmanager


class UsageError(Exception):
    """What was wrong with a command, what is allowed and what to do; exit code 2."""


@contextmanager
def usage_errors() -> Iterator[None]:
    """Around the preparation of a command: there, bad input is the user's error, not a bug, and so
    is what is not installed (a package, or a system library: RuntimeError).

    Not around the work itself, where the same exceptions would hide a bug.
    """
    try:
        yield
    except (ValueError, OSError, ImportError, RuntimeError) as error:
        raise UsageError(" ".join(str(error).split())) from error
