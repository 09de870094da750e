"""A saved policy drives as the model does that it was saved from, its task beside it."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grouser.agents.learned import ALGORITHMS, LearnedDriver, algorithm_class, save_policy
from grouser.agents.navigation import GoalNavEnv

pytest.importorskip(
    "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'"
)

TASK: dict[str, Any] = {"beams": 12, "covariance": True, "policy_sensors": ["lidar"]}
POLICIES = {"ppo": "MultiInputPolicy", "sac": "MultiInputPolicy"}
SMALL: dict[str, dict[str, Any]] = {
    "ppo": {"n_steps": 32, "batch_size": 32},
    "sac": {"buffer_size": 64},
    "recurrent-ppo": {"n_steps": 32, "batch_size": 32},
}


def untrained(algorithm: str, env: GoalNavEnv) -> Any:
    policy = POLICIES.get(algorithm, "MultiInputLstmPolicy")
    return algorithm_class(algorithm)(policy, env, seed=0, device="cpu", **SMALL[algorithm])


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_saved_policy_does_what_its_model_does(algorithm: str, tmp_path: Path) -> None:
    if algorithm == "recurrent-ppo":
        pytest.importorskip("sb3_contrib", reason="pip install sb3-contrib")
    env = GoalNavEnv(robot={"dynamics": "fast"}, **TASK)
    model = untrained(algorithm, env)
    save_policy(model, tmp_path / "policy.zip", algorithm=algorithm, task=TASK)
    driver = LearnedDriver(tmp_path / "policy.zip")
    assert driver.task == TASK
    for _ in range(2):  # a second episode forgets the first
        shown, _ = env.reset(seed=0)
        driver.reset(env.rig, env.world)
        memory, first = None, np.ones(1, dtype=bool)
        for _ in range(4):
            wanted, memory = model.predict(
                shown, state=memory, episode_start=first, deterministic=True
            )
            first = np.zeros(1, dtype=bool)
            action = driver.action(shown, env.believed, env.goal)
            assert np.array_equal(action, wanted) and action in env.action_space
            shown = env.step(action)[0]


def test_what_does_not_shape_the_view_is_not_saved(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'world' shapes no view of a policy; policy_sensors, "):
        save_policy(None, tmp_path / "p.zip", algorithm="ppo", task={"world": "yard"})
    with pytest.raises(ValueError, match="no algorithm is named 'pop'; did you mean 'ppo'"):
        save_policy(None, tmp_path / "p.zip", algorithm="pop", task={})
    assert not list(tmp_path.iterdir())


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="there is no policy at .*nothing.zip"):
        LearnedDriver(tmp_path / "nothing.zip")
    (tmp_path / "text.zip").write_text("no zip")
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as made:
        made.writestr("data", json.dumps({}))
    (tmp_path / "foreign.zip").write_bytes(archive.getvalue())
    for name in ("text.zip", "foreign.zip"):
        with pytest.raises(ValueError, match=f"{name} is no policy of Grouser's"):
            LearnedDriver(tmp_path / name)
