"""Does memory grow? `python scripts/soak.py`: many steps and resets, and what they left behind."""

import sys
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track

from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.scripts.memory import peak_megabytes
from grouser.scripts.usage import UsageError, usage_errors

_WARM_UP_EPISODES = 5


@dataclass(frozen=True)
class Soak:
    """Drive at random for many episodes and say by how much the process's memory grew.

    Memory is the peak of the resident set; what the first episodes take (kernels, textures, the
    physics client) does not count. The exit code is 1 when it grew by more than --limit.

    Some to try:

    python scripts/soak.py

    python scripts/soak.py --sensors left right lidar --steps 20000 --world forest
    """

    steps: int = 100_000
    """Steps of all episodes together."""
    resets: int = 500
    """Episodes."""
    world: str = "yard"
    """Kind of world; every episode has a new one."""
    dynamics: Literal["bullet", "fast"] = "bullet"
    """Which physics moves the robot."""
    sensors: tuple[str, ...] = ("tracks", "lidar", "imu")
    """What is observed."""
    limit: Annotated[float, tyro.conf.arg(metavar="MB")] = 50.0
    """Largest growth that passes."""

    def run(self) -> int:
        """Drive, print the growth, and return the exit code."""
        if self.steps < 1 or self.resets < 1:
            raise UsageError(
                f"--steps and --resets must be at least 1, got {self.steps} and {self.resets}"
            )
        with usage_errors():
            env = TrackedRobotEnv(world=self.world, dynamics=self.dynamics, sensors=self.sensors)
        grown = self._growth_of(env)
        print(f"{self.steps} steps, {self.resets} resets: memory grew by {grown:.1f} MB")
        return int(grown > self.limit)

    def _growth_of(self, env: TrackedRobotEnv) -> float:
        actions = np.random.default_rng(0).uniform(-1, 1, (1 + self.steps, 2)).astype(np.float32)
        length, more = divmod(self.steps, self.resets)
        before, step = 0.0, 0
        errors = Console(stderr=True)
        for episode in track(
            range(self.resets), "driving", console=errors, disable=not errors.is_terminal
        ):
            if episode == min(_WARM_UP_EPISODES, self.resets - 1):
                before = peak_megabytes()
            env.reset(seed=episode)
            for _ in range(length + (episode < more)):
                env.step(actions[step])
                step += 1
        env.close()
        return peak_megabytes() - before


def main() -> int:
    """The command line; the exit code is 2 for a misuse."""
    try:
        return tyro.cli(Soak, prog="soak.py").run()
    except UsageError as error:
        print(f"soak.py: error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
