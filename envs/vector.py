"""Many robots at once, in as many processes as there are processors: what `gym.make_vec` makes."""

from functools import partial
from typing import Any

import gymnasium as gym
from gymnasium.vector import AutoresetMode

from grouser.envs.fleet.robot_vector import RobotVectorEnv
from grouser.envs.tracked_robot_truth import TRUTH

_ID = "grouser/TrackedRobot-v0"


def tracked_robots(
    num_envs: int,
    *,
    context: str | None = None,
    copy: bool = True,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    **options: Any,
) -> RobotVectorEnv:
    """Tracked robots; the n-th, seeded with s + n, shows the bits of a single one.

    Args:
        num_envs: how many.
        context: how processes start, as multiprocessing has it: "fork", "spawn" or "forkserver".
        copy: return observations in memory of their own; else the next step writes over them.
        autoreset_mode: when a robot whose episode ended (by a wrapper) starts a new one.
        options: those of `TrackedRobotEnv`.
    """
    return RobotVectorEnv(
        [partial(gym.make, _ID, **options)] * num_envs,
        info=TRUTH,
        context=context,
        copy=copy,
        autoreset_mode=autoreset_mode,
        # OpenGL does not survive a fork: were it at work here, no other vector could be made.
        caller_steps=options.get("renderer") != "opengl",
    )
