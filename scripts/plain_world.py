"""Nothing but ground: where motion is compared."""

from dataclasses import replace

import numpy as np

from grouser.envs.simulation.ground import Ground
from grouser.envs.simulation.world import Boxes, World

_HALF_SIZE = 100.0
"""m"""


def plain_world(soil: str, *, slope: float = 0.0) -> World:
    """A plane of one soil that rises along x.

    Args:
        soil: of `materials.MATERIAL_NAMES`.
        slope: rad.
    """
    rise = _HALF_SIZE * np.tan(slope)
    ground = Ground.flat(_HALF_SIZE, soil)
    return World(
        name="plain",
        solids=Boxes.none(),
        n_walls=0,
        ground=replace(ground, heights=np.tile([-rise, rise], (2, 1))) if slope else ground,
        start=np.zeros(3),
        clear_radius=_HALF_SIZE,
    )
