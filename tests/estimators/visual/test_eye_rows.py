"""How the eyes' rows differ: recovered among wrong matches, and forgotten when it changes."""

import numpy as np
import pytest

from grouser.estimators.visual.eye_rows import EyeRowsFit
from grouser.geometry import Array

HALF = np.array([160.0, 120.0])
SHAPE = (240, 320)
TRUE = np.array([0.3, -0.2, 0.1, 0.9])


def seen(
    rng: np.random.Generator, true: Array, n: int = 200, wrong: float = 0.2
) -> tuple[Array, Array, Array]:
    """Points, how much lower each is seen, and texture, which goes with the noise."""
    points = rng.uniform(0, 2 * HALF, (n, 2))
    x, y = ((points - HALF) / HALF).T
    texture = 10 ** rng.uniform(2, 4, n)
    lower = true @ [np.ones(n), x, y, x * y] + rng.normal(0, 5 / np.sqrt(texture))
    far_off = rng.random(n) < wrong
    lower[far_off] = rng.uniform(-1.5, 1.5, far_off.sum())
    return points, lower, texture


def fitted(seed: int, keyframes: int, true: Array = TRUE) -> EyeRowsFit:
    rng, fit = np.random.default_rng(seed), EyeRowsFit()
    for _ in range(keyframes):
        fit.learn(*seen(rng, true), HALF)
    return fit


@pytest.mark.parametrize("seed", range(4))
def test_one_keyframe_tells_to_a_tenth_of_a_pixel_and_ten_to_a_twentieth(seed: int) -> None:
    places = np.array([[0.0, 0.0], [320.0, 0.0], [0.0, 240.0], [320.0, 240.0], [160.0, 120.0]])
    x, y = ((places - HALF) / HALF).T
    truth = TRUE @ [np.ones(5), x, y, x * y]
    for keyframes, limit in ((1, 0.12), (10, 0.06)):
        error = fitted(seed, keyframes).rows(SHAPE).at(places) - truth
        assert np.sqrt(np.mean(error**2)) < limit


def test_where_nothing_is_known_the_calibration_holds() -> None:
    fit = EyeRowsFit()
    nothing = np.zeros((0, 2)), np.zeros(0), np.zeros(0)
    fit.learn(*nothing, HALF)
    assert fit.empty and (fit.rows(SHAPE).at(np.ones((3, 2))) == 0).all()
    one = np.array([[40.0, 40.0]]), np.array([0.7]), np.array([200.0])
    fit.learn(*one, HALF)
    assert not fit.empty and np.abs(fit.coefficients).max() < 0.5, "one point is not believed all"
    unknown = np.array([[40.0, 40.0]]), np.array([np.nan]), np.array([np.nan])
    before = fit.coefficients
    fit.learn(*unknown, HALF)
    np.testing.assert_array_equal(fit.coefficients, before)


def test_a_rectification_that_changes_is_followed() -> None:
    fit, rng = fitted(0, 20), np.random.default_rng(5)
    for _ in range(80):
        fit.learn(*seen(rng, -TRUE), HALF)
    np.testing.assert_allclose(fit.coefficients, -TRUE, atol=0.06)


def test_no_pair_is_taken_to_differ_by_more_than_rectified_ones_do() -> None:
    fit = EyeRowsFit()
    rng = np.random.default_rng(1)
    for _ in range(10):
        fit.learn(*seen(rng, np.array([9.0, 0.0, 0.0, 9.0]), wrong=0.0), HALF)
    assert np.abs(fit.rows(SHAPE).at(rng.uniform(0, 2 * HALF, (50, 2)))).max() <= 3.0
