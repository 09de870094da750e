"""The truth has the entries that it says it has."""

import numpy as np

from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.envs.tracked_robot_truth import TRUTH


def test_every_entry_has_its_type_and_shape() -> None:
    env = TrackedRobotEnv(sensors=(), dynamics="fast")
    for info in (env.reset(seed=0)[1], env.step(np.array([0.2, 0.6], np.float32))[4]):
        assert info.keys() == TRUTH.keys()
        for key, (dtype, shape) in TRUTH.items():
            assert np.shape(info[key]) == shape
            assert np.asarray(info[key]).dtype == np.dtype(dtype)
            assert isinstance(info[key], dtype if shape == () else np.ndarray)
    env.close()
