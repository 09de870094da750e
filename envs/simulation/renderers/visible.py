"""What a camera may see of a mesh: convex polygons in the image, with what varies over them."""

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

MAX_CORNERS: Final = 5
"""A quadrilateral clipped by one plane has at most five corners."""

W, U, V = 0, 3, 7
"""Where the coefficients of w (3), of u (3 and its constant) and of v (3 and its constant) begin
in a row of `planes`."""
N_PLANES: Final = 11


class Visible(NamedTuple):
    """Room for n polygons, as kernels fill it from the front."""

    polygons: NDArray[np.float64]
    """(n, MAX_CORNERS, 2) px."""
    n_corners: NDArray[np.int32]
    """(n,) corners in use."""
    planes: NDArray[np.float64]
    """(n, N_PLANES): inverse depth and texture coordinates as functions of the pixel."""
    planes32: NDArray[np.float32]
    """The same, rounded, for what needs no more."""
    shade: NDArray[np.float32]
    """(n, 3) brightness: a + b u + c v."""
    texture: NDArray[np.int32]
    object: NDArray[np.int32]
    surface: NDArray[np.int32]


def room_for(n: int) -> Visible:
    """Memory for n polygons; the system gives only what is written to."""
    integers: Any = [np.empty(n, dtype=np.int32) for _ in range(4)]
    return Visible(
        polygons=np.empty((n, MAX_CORNERS, 2)),
        n_corners=integers[0],
        planes=np.empty((n, N_PLANES)),
        planes32=np.empty((n, N_PLANES), dtype=np.float32),
        shade=np.empty((n, 3), dtype=np.float32),
        texture=integers[1],
        object=integers[2],
        surface=integers[3],
    )
