"""Every effect on images makes the claim it makes: sizes, directions, shares."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading
from grouser.envs.sensors.eye import Eye, EyeEffects, EyeMemory, Scene
from grouser.envs.sensors.lens import Lens, displaced
from grouser.envs.sensors.stereo import EYES, Stereo
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.geometry import Array, inverse_transform, lift
from tests.envs.sensors.motions import at_rest, generators, quiet, readings
from tests.envs.sensors.test_stereo import stereo_camera

CAMERA = stereo_camera()
WORLD = make_world("yard", np.random.default_rng(2))
DISTANCE = 2.0
BEACON = CAMERA.T_base_camera @ np.array([0.0, 0.0, DISTANCE, 1.0])
"""Straight ahead of the left camera of a robot at the origin."""
SCENE = Scene(brightness=1.0, sun=None, elapsed=0.1)
LEVEL = 100
Floats = NDArray[np.float64]


class Beacon(Renderer):
    """Draws a bright spot where a point in the world is seen: easy to find to a part of a pixel."""

    def images(self, poses: Sequence[Array]) -> list[NDArray[np.uint8]]:
        return [self._spot(T) for T in poses]

    def depth(self, T_world_camera: Array) -> NDArray[np.float32]:
        raise NotImplementedError

    def segmentation(self, T_world_camera: Array) -> NDArray[np.int32]:
        raise NotImplementedError

    def _spot(self, T_world_camera: Array) -> NDArray[np.uint8]:
        x, y, z, _ = inverse_transform(T_world_camera) @ BEACON
        row, column = np.indices((CAMERA.height, CAMERA.width))
        u, v = CAMERA.cx + CAMERA.fx * x / z, CAMERA.cy + CAMERA.fy * y / z
        spot = 200 * np.exp(-((column - u) ** 2 + (row - v) ** 2) / (2 * 2.0**2))
        return np.asarray(spot[..., None], dtype=np.uint8)


class Stripe(Beacon):
    """Draws it as high as the image."""

    def _spot(self, T_world_camera: Array) -> NDArray[np.uint8]:
        x, _, z, _ = inverse_transform(T_world_camera) @ BEACON
        column = np.arange(CAMERA.width) - CAMERA.cx - CAMERA.fx * x / z
        stripe = 200 * np.exp(-(column**2) / (2 * 2.0**2))
        return np.tile(stripe.astype(np.uint8)[None, :, None], (CAMERA.height, 1, 1))


def to_the_right(speed: float) -> Motion:
    """A robot that drifts sideways, to the right, and is at the origin at the end."""
    rest = at_rest(np.eye(4))
    path = rest.path.copy()
    path[:, 1] = speed * 0.1 * np.linspace(1.0, 0.0, len(path))
    return replace(rest, path=path)


def seen(renderer: Renderer, motion: Motion, effects: Mapping[str, float]) -> dict[str, Floats]:
    """Images of the pair (H, W), drawn by this renderer."""
    sensor = Stereo(CAMERA, eyes=EYES, color=False, dt=0.1)
    sensor.enter(WORLD, generators(0))
    sensor.close()
    sensor._renderer = renderer
    sensor.advance(motion)
    shown = sensor.read(motion, quiet(effects))
    return {eye: shown[eye][..., 0].astype(np.float64) for eye in EYES}


def centroid(image: Floats) -> Floats:
    """(x, y) px."""
    rows, columns = np.indices(image.shape)
    return np.asarray([(columns * image).sum(), (rows * image).sum()]) / float(image.sum())


def spread(image: Floats) -> float:
    """Standard deviation along x, px."""
    columns = np.arange(image.shape[1])
    share = image.sum(axis=0) / image.sum()
    return float(np.sqrt(share @ (columns - share @ columns) ** 2))


PIXELS_PER_METRE = CAMERA.fx / DISTANCE


@pytest.mark.parametrize(("speed", "shutter"), [(0.5, 0.05), (1.0, 0.05), (1.0, 0.1)])
def test_motion_blur_is_as_long_as_the_way_that_the_picture_moves(
    speed: float, shutter: float
) -> None:
    """speed * shutter * f / Z: a uniform smear of that length widens the spot by its variance."""
    sharp = seen(Beacon(), to_the_right(speed), {})["left"]
    blurred = seen(Beacon(), to_the_right(speed), {"stereo.motion_blur": shutter})["left"]
    length = np.sqrt(12 * (spread(blurred) ** 2 - spread(sharp) ** 2))
    assert length == pytest.approx(speed * shutter * PIXELS_PER_METRE, rel=0.08)
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=0.1)  # no light is lost
    # The shutter closes at the end of the motion: the spot is, in the mean, half a length behind.
    assert (centroid(blurred) - centroid(sharp))[0] == pytest.approx(length / 2, rel=0.12)


def test_a_robot_at_rest_blurs_nothing() -> None:
    effects = {"stereo.motion_blur": 0.1, "stereo.rolling_shutter": 0.1}
    blurred = seen(Beacon(), at_rest(np.eye(4)), effects)["left"]
    np.testing.assert_array_equal(blurred, seen(Beacon(), at_rest(np.eye(4)), {})["left"])


def test_a_rolling_shutter_slants_what_is_upright() -> None:
    """The last row is of now; the first row is older by the readout."""
    speed, readout = 1.0, 0.08
    rolled = seen(Stripe(), to_the_right(speed), {"stereo.rolling_shutter": readout})["left"]
    columns = np.arange(CAMERA.width)
    places = (rolled @ columns) / rolled.sum(axis=1)
    lean = readout * speed * PIXELS_PER_METRE
    assert places[0] - places[-1] == pytest.approx(lean, abs=0.1)
    assert places[-1] == pytest.approx(CAMERA.cx, abs=0.05)
    straight = np.linspace(places[0], places[-1], len(places))
    assert np.abs(places - straight).max() < 0.15  # no steps


def test_desynchronised_eyes_err_in_disparity_by_the_way_between() -> None:
    speed, delay = 1.0, 0.03
    motion = to_the_right(speed)
    late = seen(Beacon(), motion, {"stereo.desynchronisation": delay})
    at_once = seen(Beacon(), motion, {})
    assert np.array_equal(late["left"], at_once["left"])
    error = (centroid(late["right"]) - centroid(at_once["right"]))[0]
    assert error == pytest.approx(delay * speed * PIXELS_PER_METRE, abs=0.1)


def test_a_right_eye_that_looks_up_or_aside_moves_its_picture_by_f_times_the_angle() -> None:
    rest, angle = at_rest(np.eye(4)), 0.02
    straight = seen(Beacon(), rest, {})
    up = seen(Beacon(), rest, {"stereo.miscalibration": angle})
    left = seen(Beacon(), rest, {"stereo.miscalibration_yaw": angle})
    moved = centroid(up["right"]) - centroid(straight["right"])
    np.testing.assert_allclose(moved, [0, CAMERA.fy * angle], atol=0.06)
    moved = centroid(left["right"]) - centroid(straight["right"])
    np.testing.assert_allclose(moved, [CAMERA.fx * angle, 0], atol=0.06)
    for shown in (up, left):
        assert np.array_equal(shown["left"], straight["left"])


@pytest.mark.parametrize("offset", [0.1, -0.5, 1.5, 2.0])
def test_a_disparity_offset_makes_all_disparities_larger(offset: float) -> None:
    rest = at_rest(np.eye(4))
    straight, off = (seen(Beacon(), rest, e) for e in ({}, {"stereo.disparity_offset": offset}))
    assert np.array_equal(off["left"], straight["left"])
    moved = centroid(off["right"]) - centroid(straight["right"])
    np.testing.assert_allclose(moved, [-offset, 0.0], atol=0.01)


def test_a_displaced_picture_keeps_its_detail() -> None:
    """Waves down to five pixels, as a camera's optics let through, and their phase."""
    column = np.arange(200.0)
    for period in (5.0, 20.0):
        for shift in (0.25, -1.5):
            wave = 100 + 50 * np.sin(2 * np.pi * column / period)
            expected = 100 + 50 * np.sin(2 * np.pi * (column - shift) / period)
            picture = np.tile(wave.astype(np.float32)[None, :, None], (8, 1, 1))
            moved = displaced(picture, shift)
            assert moved.shape == picture.shape
            assert np.abs(moved[4, 10:-10, 0] - expected[10:-10]).max() < 1.0


# --- one eye -------------------------------------------------------------------------------------

LENS = Lens(CAMERA)


def memory(seed: int = 0) -> EyeMemory:
    rngs = generators(seed)
    return EyeMemory(rngs["left"], Streams(rngs["left"]), Streams(rngs["left"]))


def of_flat_light(
    level: int,
    scene: Scene = SCENE,
    gain: float = 1.0,
    m: EyeMemory | None = None,
    **effects: float,
) -> Floats:
    """What an eye makes of a grey wall, (H, W)."""
    light = np.full((CAMERA.height, CAMERA.width, 1), level, dtype=np.uint8)
    amounts = EyeEffects.of("left", quiet({f"left.{k}": a for k, a in effects.items()}))
    image = Eye(LENS).image(light, scene, gain, amounts, m or memory())
    return image[..., 0].astype(np.float64)


@pytest.mark.parametrize("level", [30, 90, 180])
def test_the_variance_of_shot_noise_is_proportional_to_the_level(level: int) -> None:
    rounding = 1 / 12
    image = of_flat_light(level, shot_noise=0.8)
    assert image.var() == pytest.approx(0.8 * level + rounding, rel=0.03)
    assert image.mean() == pytest.approx(level, abs=0.1)


def test_in_darkness_the_light_goes_and_the_noise_stays() -> None:
    bright, dark = (of_flat_light(200, darkness=d, read_noise=3.0) for d in (0.0, 0.8))
    assert bright.mean() == pytest.approx(200, abs=0.1)
    assert dark.mean() == pytest.approx(40, abs=0.1)
    assert dark.std() == pytest.approx(bright.std(), rel=0.02)
    assert of_flat_light(200, darkness=1.0).max() == 0


def test_a_gain_multiplies_the_light() -> None:
    assert of_flat_light(LEVEL, gain=1.2).mean() == pytest.approx(120)
    assert of_flat_light(LEVEL, gain=3.0).max() == 255  # and saturates


def test_vignetting_takes_its_share_in_the_corners_and_none_in_the_middle() -> None:
    image = of_flat_light(200, vignetting=0.6)
    assert image[CAMERA.height // 2, CAMERA.width // 2] == 200
    for row in (0, -1):
        for column in (0, -1):
            assert image[row, column] == pytest.approx(80, abs=1)
    halfway = image[CAMERA.height // 2, -1]
    assert 80 < halfway < 200


def test_the_exposure_wanders_by_its_standard_deviation() -> None:
    """And both eyes draw the same."""
    m, other = memory(), memory()
    scene = replace(SCENE, elapsed=1000.0)  # forgotten from one frame to the next
    means = [
        of_flat_light(LEVEL, scene, m=m, exposure_drift=0.1)[:4, :4].mean() for _ in range(300)
    ]
    again = [
        of_flat_light(LEVEL, scene, m=other, exposure_drift=0.1)[:4, :4].mean() for _ in range(20)
    ]
    assert np.std(np.log(np.array(means) / LEVEL)) == pytest.approx(0.1, rel=0.12)
    assert means[:20] == again


def test_defocus_spreads_light_by_its_standard_deviation() -> None:
    sharp = Beacon()._spot(CAMERA.T_base_camera)
    effects = EyeEffects.of("left", quiet({"left.defocus": 3.0}))
    blurred = Eye(LENS).image(sharp, SCENE, 1.0, effects, memory())[..., 0].astype(np.float64)
    before = spread(sharp[..., 0].astype(np.float64))
    assert spread(blurred) == pytest.approx(np.hypot(before, 3.0), rel=0.03)
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=0.03)


def test_a_distorted_image_is_straightened_again() -> None:
    """It is where it was, less sharp, and black where the sensor saw nothing."""
    rng = np.random.default_rng(0)
    coarse = rng.integers(40, 220, (24, 32)).astype(np.float32)
    picture = np.kron(coarse, np.ones((10, 10), np.float32))[..., None]
    for k1 in (-0.2, 0.2):
        raw = LENS.distorted(picture, k1)
        straight = LENS.rectified(raw.astype(np.uint8), k1)[..., 0].astype(np.float64)
        seen_by_both = np.s_[40:200, 50:270]
        left = np.abs(straight - picture[..., 0])[seen_by_both].mean()
        bent = np.abs(raw - picture)[seen_by_both].mean()
        assert left < 4 and bent > 3 * left
    assert (LENS.rectified(np.full((240, 320, 1), 99, np.uint8), 0.2) == 0).any()


@pytest.mark.parametrize("k1", [-0.1, 0.1])
def test_what_the_rectification_gets_wrong_is_left(k1: float) -> None:
    """A spot at the angle r from the axis is off by f k1 r^3."""
    x, y = 0.4, 0.2
    row, column = np.indices((CAMERA.height, CAMERA.width))
    u, v = CAMERA.cx + CAMERA.fx * x, CAMERA.cy + CAMERA.fy * y
    spot = (200 * np.exp(-((column - u) ** 2 + (row - v) ** 2) / 8))[..., None].astype(np.float32)
    effects = EyeEffects.of("left", quiet({"left.rectification_error": k1}))
    image = Eye(LENS).image(spot, SCENE, 1.0, effects, memory())[..., 0].astype(np.float64)
    r2 = x**2 + y**2
    expected = CAMERA.fx * k1 * r2 * np.array([x, y])
    np.testing.assert_allclose(centroid(image) - [u, v], expected, atol=0.15)


# --- frames --------------------------------------------------------------------------------------


def frames(n: int, effects: Mapping[str, float]) -> list[Reading]:
    """Of small images with noise, so that no two of them are alike."""
    sensor = Stereo(stereo_camera((32, 24)), eyes=EYES, color=False, dt=0.1)
    noisy = quiet({"stereo.read_noise": 3.0, **effects})
    shown = readings(sensor, WORLD, [at_rest(lift(WORLD.start))] * n, noisy)
    sensor.close()
    return shown


def test_the_share_of_black_frames_is_the_one_stated_and_they_are_of_both_eyes() -> None:
    shown = frames(600, {"stereo.dropped": 0.2})
    black = np.array([[not reading[eye].any() for eye in EYES] for reading in shown])
    assert black[:, 0].mean() == pytest.approx(0.2, abs=0.05)
    assert np.array_equal(black[:, 0], black[:, 1])
    only = frames(100, {"right.dropped": 0.2})
    assert all(reading["left"].any() for reading in only)
    assert not all(reading["right"].any() for reading in only)


def test_the_share_of_frozen_frames_is_the_one_stated() -> None:
    shown = frames(600, {"stereo.frozen": 0.3})
    for eye in EYES:
        again = [
            np.array_equal(one[eye], other[eye])
            for one, other in zip(shown, shown[1:], strict=False)
        ]
        assert np.mean(again) == pytest.approx(0.3, abs=0.06)
    one, other = next(
        (a, b)
        for a, b in zip(shown, shown[1:], strict=False)
        if np.array_equal(a["left"], b["left"])
    )
    assert not np.may_share_memory(one["left"], other["left"])


# --- light ---------------------------------------------------------------------------------------


def lit_from(azimuth: float, height: float) -> World:
    """The yard, with a sun at an angle from the robot's heading, and so high [rad]."""
    a = WORLD.start[2] + azimuth
    direction = np.array([np.cos(a) * np.cos(height), np.sin(a) * np.cos(height), np.sin(height)])
    return replace(WORLD, light=replace(WORLD.light, direction=direction))


def brightness(world: World, effects: Mapping[str, float]) -> float:
    sensor = Stereo(stereo_camera((64, 48)), eyes=("left",), color=False, dt=0.1)
    (shown,) = readings(sensor, world, [at_rest(lift(world.start))], quiet(effects))
    sensor.close()
    return float(shown["left"].mean())


def test_the_sun_blinds_who_looks_at_it() -> None:
    """Not from behind, and not when a wall stands before it."""
    gained = {
        name: brightness(world, {"stereo.glare": 0.8}) - brightness(world, {})
        for name, world in {
            "ahead": lit_from(0.0, 0.45),
            "behind": lit_from(np.pi, 0.45),
            "hidden": lit_from(0.0, 0.0),
        }.items()
    }
    assert gained["ahead"] > 8
    assert abs(gained["behind"]) < 0.5 and gained["hidden"] == 0


def test_at_dusk_half_of_the_light_is_left_after_its_half_life() -> None:
    world = replace(WORLD, light=replace(WORLD.light, half_life=0.5))
    sensor = Stereo(stereo_camera((64, 48)), eyes=("left",), color=False, dt=0.1)
    shown = readings(sensor, world, [at_rest(lift(world.start))] * 11, quiet())
    sensor.close()
    means = [float(reading["left"].mean()) for reading in shown]
    assert means[5] / means[0] == pytest.approx(0.5, abs=0.01)
    assert means[10] / means[0] == pytest.approx(0.25, abs=0.01)
