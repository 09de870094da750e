"""How much memory a process takes."""

import resource
import sys

_BYTES_OF_MAXRSS = 1 if sys.platform == "darwin" else 1024


def peak_megabytes() -> float:
    """The peak of this process's resident set so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _BYTES_OF_MAXRSS / 1e6
