"""A training that was killed ends with the same policy, bit for bit, as one that was not."""

import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest

pytest.importorskip(
    "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'"
)

from grouser.agents.learned import LearnedDriver
from grouser.agents.learning.task import TrainingTask
from grouser.agents.learning.training import Training, train


def training(folder: Path, algorithm: str = "ppo", steps: int = 1024) -> Training:
    task = TrainingTask(estimator="dead-reckoning")
    return Training(task, algorithm, steps, 3, folder, n_envs=2, chapter=512)


def weights(policy: Path) -> bytes:
    with zipfile.ZipFile(policy) as archive:
        return archive.read("policy.pth")


def nothing(steps: int, success: float | None) -> None:
    pass


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "recurrent-ppo"])
def test_an_interrupted_training_ends_as_another(algorithm: str, tmp_path: Path) -> None:
    whole, halted = (training(tmp_path / name, algorithm) for name in ("whole", "halted"))
    train(whole, nothing)

    def interrupt(steps: int, success: float | None) -> None:
        if steps > 600:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(halted, interrupt)
    assert not halted.policy.exists()
    train(halted, nothing)
    assert weights(halted.policy) == weights(whole.policy)
    assert LearnedDriver(halted.policy).task == {"covariance": False}


_PROGRAM = """
from pathlib import Path
from grouser.agents.learning.task import TrainingTask
from grouser.agents.learning.training import Training, train
task = TrainingTask(estimator="dead-reckoning")
train(Training(task, "ppo", 1024, 3, Path({folder!r}), n_envs=2, chapter=512), lambda *_: None)
"""


def test_a_killed_training_ends_as_another(tmp_path: Path) -> None:
    whole, killed = training(tmp_path / "whole"), training(tmp_path / "killed")
    train(whole, nothing)
    program = _PROGRAM.format(folder=str(killed.folder))
    process = subprocess.Popen([sys.executable, "-c", program])
    until = time.monotonic() + 120
    while not (killed.folder / "checkpoint.zip").exists() and time.monotonic() < until:
        assert process.poll() is None, "it ended before it was killed"
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not killed.policy.exists()
    train(killed, nothing)
    assert weights(killed.policy) == weights(whole.policy)


def test_another_seed_learns_something_else(tmp_path: Path) -> None:
    first = training(tmp_path / "a", steps=512)
    other = Training(first.task, "ppo", 512, 4, tmp_path / "b", n_envs=2, chapter=512)
    train(first, nothing)
    train(other, nothing)
    assert weights(first.policy) != weights(other.policy)


def test_tensorboard_gets_a_log(tmp_path: Path) -> None:
    train(training(tmp_path, steps=512), nothing)
    assert list(tmp_path.glob("log_*/events.out.tfevents.*"))
