"""Plain matrices drive as the network does that they are from, and need nothing of it."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grouser.agents.learned import LearnedDriver, save_plain, save_policy
from grouser.agents.learning.mlp import MlpPolicy, plain_policy
from grouser.agents.navigation import GoalNavEnv

pytest.importorskip(
    "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'"
)


@pytest.fixture(scope="module")
def env() -> GoalNavEnv:
    return GoalNavEnv(robot={"dynamics": "fast"})


def model(algorithm: str, env: GoalNavEnv) -> Any:
    from grouser.agents.learning.algorithms import FallingRate, new_model

    return new_model(algorithm, env, FallingRate(), seed=0, log=None)


def test_they_squash_as_the_network_does(env: GoalNavEnv) -> None:
    trained = model("sac", env)
    plain = plain_policy(trained, "sac")
    assert plain is not None
    for _ in range(20):
        shown = env.observation_space.sample()
        wanted, _ = trained.predict(shown, deterministic=True)
        np.testing.assert_allclose(plain(shown, np.random.default_rng(0)), wanted, atol=2e-6)


def test_they_draw_as_the_network_does(env: GoalNavEnv) -> None:
    """Mean and spread of actions as the environment gets them: drawn, then clipped."""
    import torch

    trained, n = model("ppo", env), 4000
    with torch.no_grad():
        trained.policy.action_net.bias[:] = torch.tensor([0.3, -0.9])
    plain = plain_policy(trained, "ppo")
    assert plain is not None
    shown = env.observation_space.sample()
    many = {key: np.repeat(value[None], n, axis=0) for key, value in shown.items()}
    wanted, _ = trained.predict(many, deterministic=False)
    drawn = plain(many, np.random.default_rng(0))
    np.testing.assert_allclose(drawn.mean(axis=0), wanted.mean(axis=0), atol=6 / np.sqrt(n))
    np.testing.assert_allclose(drawn.std(axis=0), wanted.std(axis=0), atol=6 / np.sqrt(n))


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_they_survive_a_file(algorithm: str, env: GoalNavEnv) -> None:
    plain = plain_policy(model(algorithm, env), algorithm)
    assert plain is not None
    again, shown = MlpPolicy.from_bytes(plain.to_bytes()), env.observation_space.sample()
    first, second = (policy(shown, np.random.default_rng(0)) for policy in (plain, again))
    np.testing.assert_array_equal(first, second)


def test_what_is_no_plain_network_is_not_made_one(env: GoalNavEnv) -> None:
    from stable_baselines3 import PPO

    assert plain_policy(PPO("MultiInputPolicy", env), "ppo") is None, "its features are others"
    assert plain_policy(model("recurrent-ppo", env), "recurrent-ppo") is None


def test_a_plain_file_needs_neither_torch_nor_stable_baselines(
    tmp_path: Path, env: GoalNavEnv
) -> None:
    save_policy(model("ppo", env), tmp_path / "policy.zip", algorithm="ppo", task={})
    save_plain(tmp_path / "policy.zip", tmp_path / "plain.zip")
    assert (tmp_path / "plain.zip").stat().st_size < 100_000
    shown, _ = env.reset(seed=0)
    whole, plain = (LearnedDriver(tmp_path / name) for name in ("policy.zip", "plain.zip"))
    for driver in (whole, plain):
        driver.reset(env.rig, env.world)
    first, second = (d.action(shown, env.believed, env.goal) for d in (whole, plain))
    assert np.array_equal(first, second)
    program = (
        "import sys; from grouser.agents.learned import LearnedDriver; "
        f"LearnedDriver({str(tmp_path / 'plain.zip')!r}); "
        "assert not {'torch', 'stable_baselines3'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_another_view_is_explained(env: GoalNavEnv) -> None:
    plain = plain_policy(model("ppo", env), "ppo")
    assert plain is not None
    shown = GoalNavEnv(beams=12, robot={"dynamics": "fast"}).observation_space.sample()
    with pytest.raises(ValueError, match="trained on 78 features and is shown 30, of .* `task`"):
        plain(shown, np.random.default_rng(0))
