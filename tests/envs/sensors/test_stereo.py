"""The stereo pair: rectified, with noise of the stated size, one eye or two."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chisquare, norm

from grouser.envs.sensors.read_noise import add_read_noise
from grouser.envs.sensors.stereo import EYES, Stereo
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.robot import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.geometry import lift
from grouser.rig import StereoCamera
from tests.envs.sensors.motions import at_rest, quiet, readings

Image = NDArray[np.uint8]


def stereo_camera(size: tuple[int, int] = (320, 240)) -> StereoCamera:
    rig = robot_rig(RobotModel(), dt=0.1, image_size=size, amounts=quiet())
    assert rig.stereo is not None
    return rig.stereo


@pytest.fixture(scope="module")
def camera() -> StereoCamera:
    return stereo_camera()


@pytest.fixture(scope="module")
def sensor(camera: StereoCamera) -> Iterator[Stereo]:
    sensor = Stereo(camera, eyes=EYES, color=False, dt=0.1)
    yield sensor
    sensor.close()


@pytest.fixture(scope="module")
def world() -> World:
    return make_world("yard", np.random.default_rng(2))


def pair(sensor: Stereo, world: World, motion: Motion) -> tuple[Image, Image]:
    (reading,) = readings(sensor, world, [motion], quiet())
    return reading["left"][..., 0], reading["right"][..., 0]


def test_disparity_is_that_of_the_depth(sensor: Stereo, camera: StereoCamera, world: World) -> None:
    """Blocks of the left image are found again f B / z to the left, on the same row."""
    motion = at_rest(lift(world.start))
    left, right = pair(sensor, world, motion)
    T = motion.T_world_base @ camera.T_base_camera
    caster, errors = RayCaster(world), []
    for y in range(40, 230, 12):
        for x in range(70, 300, 24):
            ray = T[:3, :3] @ [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0]
            unit = ray / np.linalg.norm(ray)
            distance = caster.cast(T[:3, 3].copy(), unit[None], 30.0)[0]
            depth = distance / np.linalg.norm(ray)
            expected = camera.fx * camera.baseline / depth
            block = left[y - 5 : y + 6, x - 5 : x + 6]
            if block.std() < 10 or distance >= 30 or x - expected < 25:
                continue
            strip = right[y - 5 : y + 6, : x + 6].astype(np.float32)
            score = cv2.matchTemplate(strip, block.astype(np.float32), cv2.TM_CCOEFF_NORMED)[0]
            best = int(np.argmax(score))
            if 0 < best < len(score) - 1 and score[best] > 0.8:
                a, b, c = score[best - 1 : best + 2]
                errors.append(x - 5 - (best + (a - c) / (2 * (a - 2 * b + c))) - expected)
    assert len(errors) > 80
    assert abs(np.median(errors)) < 0.05  # px: the pair's scale is right to better than 1 %
    assert np.mean(np.abs(errors) < 1.0) > 0.95


def test_noise_is_white_and_of_the_stated_size() -> None:
    image = np.full((240, 320, 1), 100, dtype=np.uint8)
    noise = add_read_noise(image, 1.5, np.random.default_rng(0)).astype(np.float64) - 100
    assert noise.std() == pytest.approx(np.hypot(1.5, np.sqrt(1 / 12)), rel=0.01)
    assert abs(noise.mean()) < 0.02
    flat = noise[..., 0]
    assert abs(np.corrcoef(flat[:, 1:].ravel(), flat[:, :-1].ravel())[0, 1]) < 0.01
    levels = np.arange(-3, 4)
    observed = np.array([(flat == k).sum() for k in levels])
    share = norm.cdf(levels + 0.5, scale=1.5) - norm.cdf(levels - 0.5, scale=1.5)
    expected = share / share.sum() * observed.sum()
    assert chisquare(observed, expected).pvalue > 1e-3


def test_noise_stays_within_eight_bits() -> None:
    for level in (0, 255):
        image = np.full((50, 50, 1), level, dtype=np.uint8)
        noisy = add_read_noise(image, 3.0, np.random.default_rng(0))
        assert abs(int(noisy.astype(np.int64).mean()) - level) <= 2  # clipped, not wrapped


def test_successive_images_have_noise_of_their_own(sensor: Stereo, world: World) -> None:
    motions = [at_rest(lift(world.start))] * 2
    first, second = readings(sensor, world, motions, quiet({"stereo.read_noise": 2.0}))
    difference = first["left"].astype(np.float64) - second["left"]
    assert difference.std() == pytest.approx(2.0 * np.sqrt(2), rel=0.05)


def test_color_images_have_three_channels(world: World) -> None:
    env = TrackedRobotEnv(sensors=("right",), color=True, image_size=(64, 48))
    observation, _ = env.reset(seed=0)
    assert observation["right"].shape == (48, 64, 3)
    red, green, blue = observation["right"][24:].reshape(-1, 3).mean(axis=0)
    assert red > green > blue  # gravel is warm
    env.close()
