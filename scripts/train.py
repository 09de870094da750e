"""`grouser train`: a policy learns to drive on an estimated pose."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from grouser.scripts.option import option


@dataclass(frozen=True)
class Train:
    """Train a policy on GoalNav under an estimator's emulated errors.

    The robot is moved by the fast dynamics and sees by lidar; its pose has errors drawn from a
    model of the estimator's (`grouser fit-emulator`). Evaluate the policy with the estimator
    itself. Needs the extra rl. A training that was killed goes on from its last checkpoint, with
    --resume, and ends with the same policy as if it had not been.

    Some to try:

    grouser train --estimator ekf-line-slam --steps 300000 --output results/driver

    grouser train --estimator dead-reckoning --algorithm recurrent-ppo --goals 3

    tensorboard --logdir results/driver
    """

    estimator: Annotated[str, option("NAME")] = "ekf-line-slam"
    """Whose errors: ground-truth (none), an estimator that has an emulator, or an emulator's JSON
    file; ekf-line-slam by default."""
    steps: Annotated[int, option("N")] = 300_000
    """Steps of all environments together; 300000 by default."""
    algorithm: Literal["ppo", "sac", "recurrent-ppo"] = "ppo"
    """How to learn; ppo by default."""
    output: Annotated[Path | None, option("DIR")] = None
    """Folder for policy.zip, checkpoint.zip and TensorBoard's log; by default a new one,
    results/train-..."""
    resume: bool = False
    """Go on with the training in --output."""
    seed: Annotated[int, option("N")] = 0
    """Of worlds, errors and the network; 0 by default."""
    worlds: Annotated[tuple[str, ...], option("NAME ...")] = ("depot",)
    """Kinds of world to learn in; depot by default, whose obstacles the lidar sees."""
    difficulty: Annotated[float, option("0..1")] = 0.5
    """How hard they are; 0.5 by default."""
    goals: Annotated[int, option("N")] = 1
    """Goals in an episode, one after another; 1 by default."""
    covariance: bool = False
    """Show the policy the estimate's covariance."""
    shuffled_covariance: bool = False
    """Show it covariances of other moments instead, as often as large but without a meaning: the
    control that a policy with --covariance is to be measured against."""

    def run(self) -> int:
        """Train, say how it went, and return the exit code."""
        from grouser.scripts.train_work import train_policy  # help and misspellings need not wait

        return train_policy(self)
