"""From how a camera moved to how the chassis did that carries it."""

import numpy as np

from grouser.geometry import Array, rotate


def chassis_motions(R: Array, t: Array, T_base_camera: Array) -> Array:
    """Motions (..., 6) of the chassis, as in `visual.motion`, from those of its camera.

    Args:
        R, t: (..., 3, 3) and (..., 3) [m]: a point p of the reference camera's frame lies at
            R p + t in the current one's.
        T_base_camera: (4, 4) mount.
    """
    mount, lever = T_base_camera[:3, :3], T_base_camera[:3, 3]
    back = np.swapaxes(R, -1, -2)
    # T_reference_current of the chassis = T_base_camera [R t]^-1 T_camera_base
    rotation = mount @ back @ mount.T
    place = lever - (mount @ back @ t[..., None])[..., 0] - rotation @ lever
    turn = np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])
    pitch = -np.arcsin(np.clip(rotation[..., 2, 0], -1, 1))
    roll = np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2])
    chord_side = rotate(-turn / 2, place[..., :2])
    return np.concatenate(
        [turn[..., None], chord_side, place[..., 2:], roll[..., None], pitch[..., None]], axis=-1
    )
