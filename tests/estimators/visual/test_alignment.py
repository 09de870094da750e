"""Sub-pixel alignment against textures whose shift, slope and warp are known exactly."""

import numpy as np
import pytest

from grouser.estimators.visual.alignment import align_plane
from grouser.estimators.visual.descriptor import Image, smooth
from grouser.estimators.visual.row_alignment import align_rows
from grouser.geometry import Array
from tests.estimators.visual.pictures import HEIGHT, WIDTH, grid, painted, plain, stripes, waves

TEXTURE = waves(np.random.default_rng(0))
LEFT = plain(TEXTURE)


def right_eye(disparity: float, slope_x: float = 0.0, slope_y: float = 0.0) -> Image:
    """What the right eye sees of a plane: d = disparity + slope_x x + slope_y y about the middle.

    A left pixel x is seen at x - d(x, y): solved here for the x that a right pixel shows.
    """

    def warp(x: Array, y: Array) -> tuple[Array, Array]:
        middle = disparity - slope_x * WIDTH / 2 + slope_y * (y - HEIGHT / 2)
        return (x + middle) / (1 - slope_x), y

    return painted(TEXTURE, warp)


def rows(right: Image, guess: float, left: Image = LEFT, limit: float = 1.5) -> Array:
    places = grid()
    points = np.column_stack([places, np.full(len(places), guess)])
    return np.asarray(align_rows(left, right, points, np.zeros(len(points)), limit)[0])


@pytest.mark.parametrize("disparity", [0.0, 6.1, 6.25, 6.5, 6.9, 12.37])
def test_disparity_to_a_few_hundredths_of_a_pixel(disparity: float) -> None:
    aligned = rows(right_eye(disparity), float(round(disparity)))
    assert np.isfinite(aligned).all()
    error = aligned[:, 0] - disparity
    assert np.sqrt(np.mean(error**2)) < 0.03 and abs(error.mean()) < 0.01


@pytest.mark.parametrize("slopes", [(0.0, 0.3), (0.1, 0.0), (-0.08, -0.2), (0.05, 0.15)])
def test_a_slanted_plane_is_recovered_with_its_slopes(slopes: tuple[float, float]) -> None:
    sx, sy = slopes
    places = grid()
    truth = 8.0 + sx * (places[:, 0] - WIDTH / 2) + sy * (places[:, 1] - HEIGHT / 2)
    near = np.abs(truth - 8.0) < 7
    points = np.column_stack([places, np.rint(truth)])[near]
    aligned, _ = align_rows(LEFT, right_eye(8.0, sx, sy), points, np.zeros(len(points)), 1.5)
    settled = np.isfinite(aligned[:, 0])
    assert settled.mean() > 0.9
    error = aligned[settled, 0] - truth[near][settled]
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert np.median(aligned[settled, 1]) == pytest.approx(sx, abs=0.02)
    assert np.median(aligned[settled, 2]) == pytest.approx(sy, abs=0.02)


def test_a_darker_eye_sees_the_same_disparity() -> None:
    right = right_eye(6.4)
    darker = (right.astype(int) - 25).clip(0, 255).astype(np.uint8)
    difference = rows(darker, 6.0)[:, 0] - rows(right, 6.0)[:, 0]
    assert np.nanmax(np.abs(difference)) < 0.02


def test_what_does_not_settle_near_the_guess_is_nan() -> None:
    assert np.isnan(rows(right_eye(9.0), 6.0, limit=1.0)[:, 0]).mean() > 0.8
    flat = np.full_like(LEFT, 90)
    assert np.isnan(rows(flat, 6.0, left=flat)).all()
    outside = np.array([[3.0, 50.0, 0.0], [80.0, 2.0, 0.0], [20.0, 50.0, 18.0]])
    assert np.isnan(align_rows(LEFT, LEFT, outside, np.zeros(3), 1.5)[0]).all()


@pytest.mark.parametrize("true", [-0.8, -0.3, 0.0, 0.4, 1.0])
def test_how_much_lower_the_right_eye_sees_is_told_and_once_known_costs_nothing(
    true: float,
) -> None:
    """Told to a seventh from the same row; once it is told, disparity is what it was, but for a
    second interpolation's error."""
    right = painted(TEXTURE, lambda x, y: (x + 6.4, y - true))
    places = grid()
    points = np.column_stack([places, np.full(len(places), 6.0)])
    guess = np.zeros(len(points))
    _, off = align_rows(LEFT, right, points, guess, 1.5)
    assert np.nanmedian(off[:, 0]) == pytest.approx(true, abs=0.05 + 0.15 * abs(true))
    aligned, left_over = align_rows(LEFT, right, points, guess + true, 1.5)
    assert np.isfinite(aligned).all()
    assert abs(np.median(left_over[:, 0])) < 0.01
    assert np.sqrt(np.mean((aligned[:, 0] - 6.4) ** 2)) < 0.05


def test_what_runs_along_the_rows_tells_no_row() -> None:
    """Upright stripes look the same in every row."""
    upright = smooth(plain(lambda x, y: stripes(y, x)), 1.0)
    points = np.column_stack([grid(), np.zeros(len(grid()))])
    _, off = align_rows(upright, upright, points, np.zeros(len(points)), 1.5)
    assert (np.nan_to_num(off[:, 1]) == 0).all()


WARPS = {
    "moved": np.eye(2),
    "nearer": 1.1 * np.eye(2),
    "farther": 0.9 * np.eye(2),
    "turned": np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]]),
    "slanted": np.array([[1.0, 0.15], [0.0, 1.1]]),
}


def warped(warp: Array, shift: Array) -> tuple[Image, Array]:
    """The picture after an affine warp about its middle and a shift, and where the grid went."""
    middle = np.array([WIDTH / 2, HEIGHT / 2])
    back = np.linalg.inv(warp)

    def source(x: Array, y: Array) -> tuple[Array, Array]:
        place = (np.stack([x, y], axis=-1) - middle - shift) @ back.T + middle
        return place[..., 0], place[..., 1]

    return painted(TEXTURE, source), (grid() - middle) @ warp.T + middle + shift


@pytest.mark.parametrize("warp", WARPS.values(), ids=WARPS.keys())
@pytest.mark.parametrize("brightness", [0, 20])
def test_a_warped_patch_is_found_to_a_twentieth_of_a_pixel(warp: Array, brightness: int) -> None:
    """Measured against the truth from guesses up to a pixel away, as corners are."""
    current, truth = warped(warp, np.array([3.3, -2.6]))
    current = (current.astype(int) - brightness).clip(0, 255).astype(np.uint8)
    guesses = truth + np.random.default_rng(1).uniform(-1, 1, truth.shape)
    warps = np.tile(warp, (len(truth), 1, 1))
    found = align_plane(LEFT, current, grid(), guesses, warps, 2.5)
    settled = np.isfinite(found[:, 0])
    assert settled.mean() > 0.9
    error = np.linalg.norm(found[settled, :2] - truth[settled], axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.05


def test_a_wrong_warp_is_worse_than_the_right_one() -> None:
    warp = WARPS["slanted"]
    current, truth = warped(warp, np.zeros(2))

    def error(assumed: Array) -> float:
        warps = np.tile(assumed, (len(truth), 1, 1))
        found = align_plane(LEFT, current, grid(), truth, warps, 2.5)
        return float(np.sqrt(np.nanmean((found[:, :2] - truth) ** 2)))

    assert error(warp) < error(np.eye(2)) / 2


def test_a_patch_says_how_far_noise_of_its_pixels_moves_it() -> None:
    """One picture in sixty exposures: the scatter of each place, along u and along v."""
    rng, places = np.random.default_rng(2), grid()
    warps, sigma = np.tile(np.eye(2), (len(places), 1, 1)), 4.0
    found = []
    for _ in range(60):
        noisy = np.clip(np.rint(LEFT + rng.normal(0, sigma, LEFT.shape)), 0, 255).astype(np.uint8)
        found.append(align_plane(LEFT, noisy, places, places, warps, 2.5))
    scatter = np.std([f[:, :2] for f in found], axis=0)
    said = sigma * np.sqrt(found[0][:, 2:])
    assert np.median(scatter / said) == pytest.approx(1.0, abs=0.15)
    assert np.corrcoef(scatter.ravel(), said.ravel())[0, 1] > 0.8


def test_an_edge_that_may_slide_along_itself_is_refused() -> None:
    edges = smooth(plain(stripes), 1.0)
    places = grid()
    warps = np.tile(np.eye(2), (len(places), 1, 1))
    assert np.isnan(align_plane(edges, edges, places, places, warps, 2.5)).all()


@pytest.mark.parametrize("warp", [np.zeros((2, 2)), -np.eye(2) * [1, -1], 10 * np.eye(2)])
def test_a_degenerate_warp_is_refused(warp: Array) -> None:
    places = grid()
    warps = np.tile(warp, (len(places), 1, 1))
    assert np.isnan(align_plane(LEFT, LEFT, places, places, warps, 2.5)).all()
