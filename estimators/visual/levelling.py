"""What a tilted keyframe makes of a motion that is seen from it.

Vision and tracks tell the motion in the chassis' own plane; the pose is kept on that of the start.
On a slope the two differ: a quarter turn on a plane that is tilted by 0.15 rad is one degree less
of heading. The tilt is that of the keyframe's pose in space, which vision keeps.
"""

import math

from grouser.estimators.visual.single_pose import wrapped
from grouser.geometry import Array
from grouser.kernels import kernel_using


@kernel_using(wrapped)
def levelling(
    T_start_keyframe: Array, relative: Array, height: float, pitch: float, added: Array
) -> None:
    """Write what is added to a pose in the keyframe's plane for that in the plane of the start.

    Args:
        relative: (3,) the pose seen from the keyframe, with its height [m] and pitch [rad] there.
        added: (3,) of x, y and heading; zero where the keyframe is level and the motion planar.
    """
    R = T_start_keyframe
    heading = math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(heading), math.sin(heading)
    x, y, turn = relative[0], relative[1], relative[2]
    # Where the chassis is, and where it points, in the keyframe.
    ahead = (math.cos(turn) * math.cos(pitch), math.sin(turn) * math.cos(pitch), -math.sin(pitch))
    placed_x = placed_y = ahead_x = ahead_y = 0.0
    for k, place in enumerate((x, y, height)):
        along, across = c * R[0, k] + s * R[1, k], -s * R[0, k] + c * R[1, k]
        placed_x += along * place
        placed_y += across * place
        ahead_x += along * ahead[k]
        ahead_y += across * ahead[k]
    added[0], added[1] = placed_x - x, placed_y - y
    added[2] = wrapped(math.atan2(ahead_y, ahead_x) - turn)
