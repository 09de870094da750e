"""Points in disparity space as rays with an inverse depth: what rigid motions are linear in.

A point (x, y, z) is the ray (x / z, y / z, 1) and the inverse depth 1 / z. Under a motion R, t the
point's ray is along R ray + t / z: a homography of disparity space (Demirdjian and Darrell 2002).
"""

import numpy as np

from grouser.geometry import Array
from grouser.rig import StereoCamera


def disparity_rays(points: Array, camera: StereoCamera) -> tuple[Array, Array]:
    """Rays (n, 3) and inverse depths (n,) [1/m] of points (n, 3) u, v, d [px]."""
    rays = np.ones_like(points)
    rays[:, 0] = (points[:, 0] - camera.cx) / camera.fx
    rays[:, 1] = (points[:, 1] - camera.cy) / camera.fy
    return rays, points[:, 2] / (camera.fx * camera.baseline)
