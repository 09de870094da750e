"""Where along a row of pixels one face shows, and where several meet."""

from typing import Any, Final

import numpy as np

from grouser.kernels import kernel

MIXED: Final = 0
"""Row of the marks: not 0 where the sub-samples of a pixel see different faces."""
BEGINS: Final = 1
"""Row of the marks: not 0 where a run of pixels of one face begins; a mixed pixel is a run of its
own. One more run begins behind the last pixel."""


def room_for_marks(width: int) -> Any:
    """Memory for the marks of a row of pixels, (2, width + 1)."""
    return np.empty((2, width + 1), dtype=np.int32)


@kernel
def mark_runs(faces: Any, marks: Any) -> None:
    """Fill in a row's marks.

    Args:
        faces: (S, width) which face each sub-sample sees.
        marks: out, (2, width + 1).
    """
    width = faces.shape[1]
    mixed, begins = marks[MIXED, :width], marks[BEGINS, :width]
    mixed[:] = 0
    for s in range(1, faces.shape[0]):
        first, other = faces[0], faces[s]
        for x in range(mixed.size):
            mixed[x] |= first[x] ^ other[x]
    begins[0], marks[BEGINS, width] = 1, 1
    # Views that begin at zero, for vector instructions.
    here, before = faces[0, 1:], faces[0, :-1]
    mixed_here, mixed_before, to = mixed[1:], mixed[:-1], begins[1:]
    for x in range(to.size):
        to[x] = (here[x] ^ before[x]) | mixed_here[x] | mixed_before[x]
