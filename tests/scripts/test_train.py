"""`grouser train` writes a policy that drives, and says what it cannot do."""

from pathlib import Path

import pytest

from grouser.scripts.cli import main

pytest.importorskip(
    "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'"
)


def test_a_policy_is_trained(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from grouser.agents.drivers import make_driver

    given = ["train", "--estimator", "dead-reckoning", "--steps", "2048", "--covariance"]
    assert main([*given, "--output", str(tmp_path / "a")]) == 0
    told = capsys.readouterr().out
    assert "2048 steps" in told and "policy.zip" in told
    assert make_driver(tmp_path / "a" / "policy.zip").task == {"covariance": True}
    assert main([*given, "--output", str(tmp_path / "a")]) == 2
    assert "already holds a training; give --resume" in capsys.readouterr().err
    assert main([*given, "--seed", "1", "--output", str(tmp_path / "a"), "--resume"]) == 2
    assert "begun with other settings: seed 0 (now 1)" in capsys.readouterr().err


def test_the_control_of_an_ablation_is_trained(tmp_path: Path) -> None:
    from grouser.agents.drivers import make_driver

    given = ["train", "--estimator", "dead-reckoning", "--steps", "2048", "--shuffled-covariance"]
    assert main([*given, "--output", str(tmp_path / "a")]) == 0
    assert make_driver(tmp_path / "a" / "policy.zip").task == {"covariance": "shuffled"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--estimator", "one-point-ransack"], "did you mean 'one-point-ransac'?"),
        (["--resume"], "--resume needs --output"),
        (["--steps", "0"], "--steps must be at least 1"),
        (["--worlds", "yard", "jard"], "did you mean 'yard'?"),
        (["--covariance", "--shuffled-covariance"], "exclude each other"),
    ],
)
def test_misuse_is_explained(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["train", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not any(tmp_path.iterdir()), "nothing is begun"
