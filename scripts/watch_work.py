"""What `grouser watch` does with its options: drive an episode and show it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.agents.drive import steps
from grouser.agents.driver import Driver
from grouser.agents.drivers import make_driver
from grouser.agents.episode import goal_task
from grouser.agents.navigation import GoalNavEnv
from grouser.scripts.terminal import Bar, progress, table_console
from grouser.scripts.usage import UsageError, usage_errors
from grouser.scripts.watch import Watch
from grouser.scripts.watch_top_view import TopView

_CODECS: Mapping[str, str] = {".mp4": "mp4v", ".avi": "MJPG"}
_PICTURE = ".png"
_TIME_LIMIT = 100.0  # s, for each goal

Show = Callable[[NDArray[np.uint8]], None]
Image = NDArray[np.uint8]


def watch(options: Watch) -> int:
    """Drive, show, tell how it ended, and return the exit code."""
    with usage_errors():
        _check(options.output)
        driver = make_driver(options.policy)
        env = _task(options, driver)
    try:
        told = _drive(options, env, driver)
    finally:
        env.close()
    table_console().print(_words(options, told))
    return 0


def _check(output: Path | None) -> None:
    if output is None:
        return
    if output.suffix not in (*_CODECS, _PICTURE):
        raise UsageError(
            f"--output {output}: a file is {', '.join(_CODECS)} (a video) or {_PICTURE}"
        )
    if not output.absolute().parent.is_dir():
        raise UsageError(f"--output: there is no folder {output.absolute().parent}; make it first")


def _task(options: Watch, driver: Driver) -> GoalNavEnv:
    return goal_task(
        driver,
        options.estimator,
        {
            "world": options.world,
            "goals": options.goals,
            "pose_latency": options.pose_latency,
            "time_limit": _TIME_LIMIT,
            "robot": {"dynamics": options.dynamics} if options.dynamics else {},
        },
        render_mode="human" if options.output is None else "rgb_array",
    )


def _drive(options: Watch, env: GoalNavEnv, driver: Driver) -> Mapping[str, Any]:
    """What `info` says at the end."""
    most = round(_TIME_LIMIT * options.goals / env.rig.dt)
    with progress(f"{options.policy} on {options.estimator}", most) as bar:
        if options.output is None:
            return _to_window(env, driver, options.seed, bar)
        if options.output.suffix == _PICTURE:
            return _to_picture(env, driver, options.seed, bar, options.output)
        return _to_video(env, driver, options.seed, bar, options.output)


def _to_window(env: GoalNavEnv, driver: Driver, seed: int, bar: Bar) -> Mapping[str, Any]:
    for step in bar.over(steps(env, driver, seed)):  # the environment shows itself
        told = step.info
    return told


def _to_picture(
    env: GoalNavEnv, driver: Driver, seed: int, bar: Bar, path: Path
) -> Mapping[str, Any]:
    view: TopView | None = None
    for step in bar.over(steps(env, driver, seed)):
        view = view or TopView(env.world)
        view.move(step.info["true_pose"], env.believed.pose)
        told = step.info
    assert view is not None
    if not cv2.imwrite(str(path), _bgr(env, view)):
        raise OSError(f"{path} cannot be written")
    return told


def _to_video(
    env: GoalNavEnv, driver: Driver, seed: int, bar: Bar, path: Path
) -> Mapping[str, Any]:
    codec = cv2.VideoWriter.fourcc(*_CODECS[path.suffix])
    view: TopView | None = None
    video: Any = None
    try:
        for step in bar.over(steps(env, driver, seed)):
            view = view or TopView(env.world)
            view.move(step.info["true_pose"], env.believed.pose)
            frame = _bgr(env, view)
            if video is None:
                size = (frame.shape[1], frame.shape[0])
                video = cv2.VideoWriter(str(path), codec, 1 / env.rig.dt, size)
                if not video.isOpened():
                    raise OSError(f"{path} cannot be written as a video by this OpenCV")
            video.write(frame)
            told = step.info
    finally:
        if video is not None:
            video.release()
    return told


def _bgr(env: GoalNavEnv, view: TopView) -> Image:
    """The robot from behind beside the world from above."""
    behind = env.render()
    assert behind is not None
    above = view.picture(env.goal, height=behind.shape[0])
    return np.ascontiguousarray(np.concatenate([behind, above], axis=1)[..., ::-1])


def _words(options: Watch, told: Mapping[str, Any]) -> str:
    return (
        f"{options.policy} on {options.estimator}, seed {options.seed}: {told['outcome']}, "
        f"{told['goals_reached']} of {options.goals} goals; the goal is "
        f"{told['distance_to_goal']:.2f} m away, by its belief "
        f"{told['believed_distance_to_goal']:.2f} m; drove {told['path_length']:.1f} m of at least "
        f"{told['shortest_path']:.1f} m" + ("" if options.output is None else f"; {options.output}")
    )
