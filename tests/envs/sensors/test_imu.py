"""The inertial unit feels gravity, centripetal acceleration and turning."""

import numpy as np
import pytest

from grouser.envs.simulation.tracks import GRAVITY
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.geometry import Array


def readings(
    action: tuple[float, float], n: int, **options: float
) -> tuple[Array, list[dict[str, Array]]]:
    env = TrackedRobotEnv(sensors=("imu",), **options)  # type: ignore[arg-type]
    env.reset(seed=0)
    steps = [env.step(np.array(action, dtype=np.float32)) for _ in range(n)]
    env.close()
    return np.array([step[0]["imu"] for step in steps]), [step[4] for step in steps]


def test_at_rest_it_feels_the_ground_push_up() -> None:
    imu, _ = readings((0.0, 0.0), 3, acceleration_noise=0.0, rate_noise=0.0)
    np.testing.assert_allclose(imu, [[0, 0, GRAVITY, 0, 0, 0]] * 3, atol=1e-9)


def test_noise_has_the_stated_size() -> None:
    imu, _ = readings((0.0, 0.0), 300, acceleration_noise=0.2, rate_noise=0.01)
    np.testing.assert_allclose(imu.std(axis=0), [0.2] * 3 + [0.01] * 3, rtol=0.2)


def test_speeding_up_adds_up_to_the_speed() -> None:
    imu, infos = readings((0.8, 0.8), 12, acceleration_noise=0.0, rate_noise=0.0)
    assert imu[:, 0].sum() * 0.1 == pytest.approx(0.4, rel=0.02)
    assert infos[-1]["true_twist"][0] == pytest.approx(0.4, rel=0.02)


def test_a_curve_is_felt_as_it_is_driven() -> None:
    imu, infos = readings((0.9, 0.4), 30, acceleration_noise=0.0, rate_noise=0.0)
    vx, _, rate = infos[-1]["true_twist"]
    assert imu[-1, 5] == pytest.approx(rate, abs=1e-6)
    assert imu[-1, 1] == pytest.approx(vx * rate, abs=0.02)  # towards the centre of the curve
