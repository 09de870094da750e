"""Lines from scans: exact without noise, honest with it, the same wherever the scan begins."""

import numpy as np
import pytest

from grouser.estimators.line_slam.extraction import ExtractionOptions, LineExtractor
from grouser.estimators.line_slam.lines import line_through, lines_in_frame, places_along
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.geometry import Array, exp, log, wrap
from grouser.rig import Lidar
from tests.estimators.line_slam.walls import ROOM, lidar, mounted, polygon, seen

ROOM_WALLS = polygon(ROOM)
POSES = [np.array([0.3, -0.4, 0.2]), np.array([-1.5, 1.2, -2.0]), np.array([2.0, 0.5, 3.0])]
L_SHAPE = polygon([[-3, -2], [4, -2], [4, 1], [1, 1], [1, 3], [-3, 3]])
HOUSE = polygon([[-4, -3], [5, -4], [6, 2], [1, 5], [-5, 3]])


def extract(walls: Array, sensor: Lidar, pose: Array, **options: float) -> LineMeasurements:
    extractor = LineExtractor(sensor, ExtractionOptions(**options))  # type: ignore[arg-type]
    return extractor.extract(seen(walls, sensor, pose))


def seen_lines(walls: Array, pose: Array) -> Array:
    """(n, 2) walls in the robot's frame, with r >= 0."""
    lines = lines_in_frame(line_through(walls[:, 0], walls[:, 1]), pose)
    turned = lines[:, 0] < 0
    return np.where(turned[:, None], np.stack([-lines[:, 0], wrap(lines[:, 1] + np.pi)], 1), lines)


def off(lines: Array, truths: Array) -> Array:
    """(n, 2) errors of lines against the nearest of the truths."""
    errors = lines[:, None] - truths
    errors[..., 1] = wrap(errors[..., 1])
    nearest = np.argmin(np.abs(errors) @ [1.0, 3.0], axis=1)
    return np.asarray(errors[np.arange(len(lines)), nearest])


@pytest.mark.parametrize("walls", [ROOM_WALLS, L_SHAPE, HOUSE])
@pytest.mark.parametrize("pose", POSES)
def test_noise_free_polygons_are_exact(walls: Array, pose: Array) -> None:
    pose = pose if walls is not L_SHAPE else np.array([-1.0, 0.2, pose[2]])
    found = extract(walls, lidar(720, mount=mounted(0.1, 0.0)), pose)
    assert len(found) >= len(walls) - 1  # one wall of the L may hide behind its corner
    np.testing.assert_allclose(off(found.lines, seen_lines(walls, pose)), 0, atol=1e-9)
    assert (found.lines[:, 0] >= 0).all()
    assert (np.diff(found.ends, axis=1)[:, 0].any(axis=1)).all()
    forward = np.diff(places_along(found.lines[:, None], found.ends), axis=1)
    assert (forward > 0).all()


@pytest.mark.parametrize("beams", [1, 45, 90, 133, 359])
def test_it_does_not_matter_which_beam_a_full_turn_begins_with(beams: int) -> None:
    rng = np.random.default_rng(3)
    walls = np.concatenate([ROOM_WALLS, [[[1.0, 1.0], [2.0, 1.0]], [[-1.0, 1.0], [-1.0, 1.1]]]])
    sensor = lidar()
    ranges = seen(walls, sensor, POSES[0], rng)
    later = lidar(start=-np.pi + beams * 2 * np.pi / 360)
    first = LineExtractor(sensor).extract(ranges)
    turned = LineExtractor(later).extract(np.roll(ranges, -beams))
    assert len(first) == len(turned) >= 5
    order, of_turned = (np.lexsort(np.round(m.lines, 6).T) for m in (first, turned))
    np.testing.assert_allclose(first.lines[order], turned.lines[of_turned], atol=1e-9)
    np.testing.assert_allclose(first.covariances[order], turned.covariances[of_turned], rtol=1e-6)
    np.testing.assert_allclose(first.ends[order], turned.ends[of_turned], atol=1e-9)
    np.testing.assert_array_equal(first.open_ends[order], turned.open_ends[of_turned])


def test_lines_are_as_far_off_as_their_covariance_says() -> None:
    rng = np.random.default_rng(4)
    sensor = lidar(360, sigma_range=0.02, sigma_bearing=0.002, mount=mounted(0.2, 0.1, 0.5))
    extractor, nees, counts = LineExtractor(sensor), [], []
    for _ in range(300):
        pose = np.append(rng.uniform([-2, -1], [3, 2]), rng.uniform(-3, 3))
        found = extractor.extract(seen(HOUSE, sensor, pose, rng))
        errors = off(found.lines, seen_lines(HOUSE, pose))
        nees.extend(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(found.covariances), errors))
        counts.append(len(found))
    assert 4.9 < np.mean(counts) <= 5.05
    assert 1.8 < np.mean(nees) < 2.6
    assert np.mean(np.array(nees) > 13.8) < 0.01  # chi-square of 2 at 99.9 %


def test_a_corner_is_split_at_its_beam() -> None:
    pose, sensor = np.zeros(3), lidar()
    found = extract(ROOM_WALLS, sensor, pose)
    assert len(found) == 4 and not found.open_ends.any()
    step = sensor.angle_increment
    # Both walls of a corner reach to within a beam of it, and no beam is missing between them.
    for corner in ROOM:
        bearing = np.arctan2(corner[1], corner[0])
        ends = found.ends.reshape(-1, 2)
        away = np.abs(wrap(np.arctan2(ends[:, 1], ends[:, 0]) - bearing))
        closest = np.sort(away)[:2]
        assert (closest <= step * (1 + 1e-9)).all() and closest.sum() <= step * (1 + 1e-9)


def test_no_line_leads_through_a_doorway() -> None:
    rng = np.random.default_rng(5)
    left, right = [[-4.0, 2.0], [-0.45, 2.0]], [[0.45, 2.0], [4.0, 2.0]]
    behind = [[-6.0, 6.0], [6.0, 6.0]]
    for walls in ([left, right], [left, right, behind]):
        found = LineExtractor(lidar()).extract(seen(np.array(walls), lidar(), (0, 0, 0), rng))
        near = found[found.lines[:, 0] < 3]
        assert len(near) == 2
        x = np.sort(near.ends[..., 0], axis=1)
        assert (np.sort(x[:, 1]) < [-0.44, 4.1]).all() and (np.sort(x[:, 0]) > [-4.1, 0.44]).all()


def test_a_thin_thing_in_front_does_not_cut_a_wall() -> None:
    rng = np.random.default_rng(6)
    post = [[[1.0, 0.0], [1.0, 0.02]]]
    walls = np.concatenate([ROOM_WALLS, post])
    for _ in range(10):
        found = LineExtractor(lidar()).extract(seen(walls, lidar(), (0, 0, 0), rng))
        assert len(found) == 4
        np.testing.assert_allclose(
            off(found.lines, seen_lines(ROOM_WALLS, np.zeros(3))), 0, atol=0.02
        )


def test_open_ends_are_those_that_are_hidden_or_out_of_reach() -> None:
    wall, screen = [[-3.0, 4.0], [2.0, 4.0]], [[-2.0, 2.0], [-0.5, 2.0]]
    background = [[-20.0, 12.0], [20.0, 12.0]]
    for walls in ([wall, screen], [wall, screen, background]):
        found = LineExtractor(lidar(720)).extract(seen(np.array(walls), lidar(720)))
        of_wall = found[np.abs(found.lines[:, 0] - 4) < 0.1]
        assert len(of_wall) == 1 and np.abs(of_wall.ends[0, :, 1] - 4).max() < 1e-9
        left = np.argmin(of_wall.ends[0, :, 0])  # hidden by the screen, from x = -1 on
        assert abs(of_wall.ends[0, left, 0] + 1) < 0.05
        assert of_wall.open_ends[0, left] and not of_wall.open_ends[0, 1 - left]
        of_screen = found[np.abs(found.lines[:, 0] - 2) < 0.1]
        assert not of_screen.open_ends.any()


def test_a_wall_out_of_range_may_go_on_and_so_may_one_beside_the_field_of_view() -> None:
    long = np.array([[[-100.0, 3.0], [100.0, 3.0]]])
    far = LineExtractor(lidar(720, range_max=8.0)).extract(seen(long, lidar(720, range_max=8.0)))
    assert far.open_ends.tolist() == [[True, True]]
    ahead = lidar(181, fov=np.pi, start=-np.pi / 2)
    found = extract(ROOM_WALLS, ahead, np.zeros(3))
    assert len(found) == 3
    front = np.abs(found.lines[:, 1]) < 0.1
    assert not found.open_ends[front].any()
    assert (found.open_ends[~front].sum(axis=1) == 1).all()


def test_skew_is_undone_by_the_motion() -> None:
    sensor = lidar(mount=mounted(0.2, 0.0))
    motion = np.array([0.1, 0.02, 0.15])
    when = np.linspace(-1.0, 0.0, sensor.n_beams)[:, None]
    ranges = seen(ROOM_WALLS, sensor, exp(when * log(motion)))
    truths = seen_lines(ROOM_WALLS, np.zeros(3))
    extractor = LineExtractor(sensor)
    np.testing.assert_allclose(off(extractor.extract(ranges, motion).lines, truths), 0, atol=1e-9)
    assert np.abs(off(extractor.extract(ranges).lines, truths)).max() > 0.02


@pytest.mark.parametrize("nothing", [np.nan, np.inf, 0.0, 30.0])
def test_without_returns_there_is_no_line(nothing: float) -> None:
    assert len(LineExtractor(lidar()).extract(np.full(360, nothing))) == 0
    few = np.full(360, nothing)
    few[3:6] = 2.0
    assert len(LineExtractor(lidar()).extract(few)) == 0


def test_a_round_pillar_is_no_line() -> None:
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    pillar = polygon(np.stack([3 + 0.4 * np.cos(angles), 0.4 * np.sin(angles)], axis=1))
    assert len(extract(pillar, lidar(720), np.zeros(3))) == 0


def test_short_pieces_and_few_beams_are_left_out() -> None:
    shelf = np.array([[[2.0, -0.25], [2.0, 0.25]]])
    assert len(extract(shelf, lidar(720), np.zeros(3))) == 0
    assert len(extract(shelf, lidar(720), np.zeros(3), min_length=0.4)) == 1
    assert len(extract(shelf, lidar(720), np.zeros(3), min_length=0.4, min_beams=60)) == 0


def test_options_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="ExtractionOptions.min_beams must be a positive whole"):
        ExtractionOptions(min_beams=0)
    with pytest.raises(ValueError, match="ExtractionOptions.sigma_range must be positive"):
        ExtractionOptions(sigma_range=0.0)
