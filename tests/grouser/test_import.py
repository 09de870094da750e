"""Importing grouser costs nothing heavy and registers the environments."""

import subprocess
import sys

HEAVY = {"pybullet", "cv2", "numba", "scipy", "matplotlib", "torch", "stable_baselines3", "pygame"}

PROBE = """
import sys
import {module}
print(sorted({heavy} & set(sys.modules)))
"""


def heavy_modules_after(module: str) -> str:
    command = [sys.executable, "-c", PROBE.format(module=module, heavy=HEAVY)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def test_importing_grouser_imports_nothing_heavy() -> None:
    assert heavy_modules_after("grouser") == "[]"


def test_importing_the_estimators_imports_nothing_heavy() -> None:
    assert heavy_modules_after("grouser.estimators") == "[]"


def test_the_probe_sees_a_heavy_module() -> None:
    assert heavy_modules_after("cv2") == "['cv2']"


def test_the_environments_are_registered_by_name() -> None:
    import gymnasium as gym

    import grouser

    assert grouser.__version__
    assert {"grouser/TrackedRobot-v0", "grouser/Replay-v0"} <= set(gym.registry)
