"""What the line sensor and the scan tell, against what is truly visible."""

import math

import numpy as np
import pytest

from grouser.envs.plane.plane_rig import noises, plane_rig
from grouser.envs.plane.sight import Sight, scanned, seen_ends, seen_feet, visible_parts
from grouser.envs.sensors.line_observer import ClosedFormObserver
from grouser.geometry import Array, compose
from grouser.rig import Rig

SEGMENTS = np.array([[5, -10, 5, 10], [-4, 6, 4, 6], [-40, -3, -20, -3], [-2, -2, -1.5, -2]], float)
POSE = np.array([0.5, -0.2, 0.4])


def rig(noise: float = 0.0) -> Rig:
    return plane_rig(
        "steering",
        dt=0.1,
        speed=1.0,
        range_max=8.0,
        n_beams=360,
        max_lines=len(SEGMENTS),
        noise=noises(noise),
    )


def lines_seen(pose: Array, *, noise: float = 0.0, seed: int = 0) -> Array:
    sensor = rig(noise).line_sensor
    assert sensor is not None
    visible = visible_parts(ClosedFormObserver(), SEGMENTS, pose, sensor.range_max)
    return seen_ends(sensor, visible, pose, np.random.default_rng(seed))


def points(rows: Array) -> Array:
    """(n, 2, 2) the ends in the vehicle's frame."""
    polar = rows.reshape(-1, 2, 2)
    along = np.stack([np.cos(polar[..., 1]), np.sin(polar[..., 1])], axis=-1)
    return np.asarray(polar[..., :1] * along)


def test_ends_lie_where_a_line_ends_or_the_range_does() -> None:
    rows = lines_seen(POSE)
    seen = points(rows[:2])
    world = compose(POSE, np.concatenate([seen, np.zeros((2, 2, 1))], axis=-1))[..., :2]
    half = math.sqrt(64 - 4.5**2)
    np.testing.assert_allclose(world[0], [[5, -0.2 - half], [5, -0.2 + half]], atol=1e-9)
    np.testing.assert_allclose(world[1], [[4, 6], [-4, 6]], atol=1e-9)
    # The third is out of range, the fourth is shorter than a metre.
    assert not rows[2:].any()


def test_rows_and_ends_go_round_counter_clockwise() -> None:
    rng = np.random.default_rng(0)
    for seed in range(200):
        rows = lines_seen(rng.uniform(-4, 4, 3), noise=1.0, seed=seed)
        rows = rows[rows.any(axis=1)]
        turn = (rows[:, 3] - rows[:, 1] + np.pi) % (2 * np.pi) - np.pi
        assert (turn >= 0).all() and (np.diff(rows[:, 1]) >= 0).all()
        assert (rows[:, [0, 2]] >= 0).all() and (np.abs(rows[:, [1, 3]]) <= np.pi).all()


def test_ends_scatter_by_the_sensors_sigmas() -> None:
    exact = lines_seen(POSE)[:2]
    told = np.array([lines_seen(POSE, noise=1.0, seed=seed)[:2] for seed in range(3000)])
    np.testing.assert_allclose(told.mean(axis=0), exact, atol=0.008)
    sigmas = [0.1, math.radians(1), 0.1, math.radians(1)]
    np.testing.assert_allclose(told.std(axis=0), [sigmas] * 2, rtol=0.05)


def test_a_scan_tells_the_nearest_segment_all_around() -> None:
    lidar = rig().lidar
    assert lidar is not None
    scan = scanned(lidar, SEGMENTS, POSE, np.random.default_rng(0))
    assert scan.dtype == np.float32 and scan.shape == (360,)
    hit = scan < 8
    at = scan * np.stack([np.cos(lidar.bearings), np.sin(lidar.bearings)])
    world = compose(POSE, np.column_stack([at.T, np.zeros(360)]))[hit, :2]
    on = np.abs(world - [5, 6]).min(axis=1) < 1e-5
    short = (np.abs(world[:, 1] + 2) < 1e-5) & (world[:, 0] < -1)
    assert (on | short).all() and on.sum() > 50 and short.sum() > 2
    assert (scan[~hit] == 8).all()


def test_ranges_and_bearings_of_a_scan_scatter_by_the_lidars_sigmas() -> None:
    lidar = rig(1.0).lidar
    assert lidar is not None
    wall = np.array([[5.0, -50.0, 5.0, 50.0]])
    rng = np.random.default_rng(1)
    scans = np.array([scanned(lidar, wall, np.zeros(3), rng) for _ in range(3000)])
    for beam in (180, 220):
        bearing = lidar.bearings[beam]
        slope = 5 * math.sin(bearing) / math.cos(bearing) ** 2
        wanted = math.hypot(lidar.sigma_range, slope * lidar.sigma_bearing)
        assert scans[:, beam].std() == pytest.approx(wanted, rel=0.05)
        assert scans[:, beam].mean() == pytest.approx(5 / math.cos(bearing), abs=0.003)


def test_between_looks_no_line_is_shown_twice_and_the_last_scan_is_with_its_stamp() -> None:
    sight = Sight(rig(1.0), ["lines", "lidar"], observer=ClosedFormObserver(), every=3)
    rngs = {key: np.random.default_rng(0) for key in ("lines", "lidar")}
    shown = [sight.look(step, SEGMENTS, POSE, rngs) for step in range(7)]
    for step, reading in enumerate(shown):
        assert set(reading) == set(sight.spaces)
        assert all(value in sight.spaces[key] for key, value in reading.items())
        assert reading["lines"].any() == (step % 3 == 0)
        last = step - step % 3
        assert reading["lidar_stamp"] == pytest.approx(0.1 * last)
        assert reading["lines_stamp"] == pytest.approx(0.1 * last)
        np.testing.assert_array_equal(reading["lidar"], shown[last]["lidar"])
    assert not np.array_equal(shown[0]["lidar"], shown[3]["lidar"])


def test_where_it_looks_at_every_step_it_needs_no_stamps() -> None:
    sight = Sight(rig(1.0), ["lines"], observer=ClosedFormObserver(), every=1)
    rngs = {"lines": np.random.default_rng(0)}
    assert set(sight.look(0, SEGMENTS, POSE, rngs)) == {"lines"} == set(sight.spaces)


def test_what_is_not_a_noise_is_refused() -> None:
    with pytest.raises(ValueError, match="no noise is named 'rang'; did you mean 'range'?"):
        noises({"rang": 1.0})
    for wrong in (-1.0, math.nan, "much", {"range": -0.1}):
        with pytest.raises(ValueError, match="a number of zero or more that multiplies all"):
            noises(wrong)  # type: ignore[arg-type]
    assert noises({"range": 0.5})["range"] == 0.5 and noises(2)["tracks"] == 0.02


def test_points_are_the_feet_of_the_worlds_origin_on_the_lines_in_sight() -> None:
    sensor = rig(0.0).line_sensor
    assert sensor is not None
    visible = visible_parts(ClosedFormObserver(), SEGMENTS, POSE, sensor.range_max)
    rows = seen_feet(sensor, SEGMENTS, visible, POSE, np.random.default_rng(0))
    shown = rows[rows.any(axis=1)]
    # Of x = 5 and y = 6; the others are out of reach, or too short.
    assert len(shown) == 2 and (np.diff(shown[:, 1]) > 0).all()
    along = shown[:, :1] * np.column_stack([np.cos(shown[:, 1]), np.sin(shown[:, 1])])
    feet = compose(POSE, np.column_stack([along, np.zeros(2)]))[:, :2]
    assert np.allclose(feet[np.argsort(feet[:, 1])], [[5, 0], [0, 6]])


def test_the_noise_of_points_is_that_of_ends() -> None:
    sensor = rig(1.0).line_sensor
    assert sensor is not None
    visible = visible_parts(ClosedFormObserver(), SEGMENTS, POSE, sensor.range_max)
    rng = np.random.default_rng(1)
    rows = np.array([seen_feet(sensor, SEGMENTS, visible, POSE, rng)[0] for _ in range(4000)])
    assert rows.std(axis=0) == pytest.approx([sensor.sigma_range, sensor.sigma_bearing], rel=0.05)
