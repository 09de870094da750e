"""How the eyes differ: recovered among wrong matches, forgotten when it changes, none by chance."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.estimators.visual.bow import Bow
from grouser.estimators.visual.eye_difference import EyeDifference, EyeDifferenceFit
from grouser.geometry import Array

SHAPE = (240, 320)
TRUE = EyeDifference(
    coefficients=np.array([0.3, -0.2, 0.1, 1.2, 0.2, -0.3]),
    told=1.0,
    bow=Bow(0.4, 0.0),
    half=np.array([160.0, 120.0]),
    focal=1.5,
)
CORNERS = np.array([[5, 5, 5], [315, 5, 5], [5, 235, 5], [315, 235, 5], [160, 120, 5.0]])


def seen(
    rng: np.random.Generator, true: Array, n: int = 200, wrong: float = 0.2
) -> tuple[Array, Array, Array]:
    """How much lower each point is seen, texture, which goes with the noise, and the points."""
    points = rng.uniform(0, [320, 240, 20], (n, 3))
    texture = 10 ** rng.uniform(2, 4, n)
    eyes = replace(TRUE, coefficients=true)
    lower = eyes.rows_at(points) + rng.normal(0, np.hypot(0.1, 5 / np.sqrt(texture)))
    far_off = rng.random(n) < wrong
    lower[far_off] = rng.uniform(-1.5, 1.5, far_off.sum())
    return lower, texture, points


def fitted(seed: int, keyframes: int, true: Array = TRUE.coefficients) -> EyeDifferenceFit:
    rng, fit = np.random.default_rng(seed), EyeDifferenceFit(TRUE.focal)
    for _ in range(keyframes):
        fit.learn(*seen(rng, true), fit.difference(SHAPE))
    return fit


SMALL = 1e-6
PX = SMALL * TRUE.focal * TRUE.half[0]  # of a ray's change


def turned(rays: Array, *, about: int) -> Array:
    """(n, 2) how far rays (n, 2) move when the eye turns a little about an axis."""
    turn = SMALL * np.eye(3)[about]
    out = np.column_stack([rays, np.ones(len(rays))])
    out += np.cross(turn, out)
    return np.asarray(out[:, :2] / out[:, 2:] - rays)


def bent(rays: Array, *, radial: float, decentering: tuple[float, float]) -> Array:
    """(n, 2) how far a lens moves rays (n, 2) (Brown 1966)."""
    x, y = rays.T
    r2, (p1, p2) = x * x + y * y, decentering
    right = radial * x * r2 + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    down = radial * y * r2 + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return SMALL * np.column_stack([right, down])


@pytest.mark.parametrize(
    ("what", "term", "size", "bow"),
    [
        ("pitch", 0, -1.0, 0.0),
        ("yaw", 3, 1.0, 1.0),
        ("roll", 1, 1.0, 0.0),
        ("focal length", 2, 1.0, 0.0),
        ("radial", 5, 1.0, 0.0),
        ("across", 4, 1.0, 0.0),
        ("along", 3, 2.0, 1.5),
    ],
)
def test_its_terms_are_what_turned_and_bent_eyes_do(
    what: str, term: int, size: float, bow: float
) -> None:
    """All but a shift of all disparities alike, which is the offset's affair."""
    points = np.random.default_rng(0).uniform([0, 0, 0], [320, 240, 40], (50, 3))
    x, y = TRUE.places(points)
    rays = np.column_stack([x, y]) / TRUE.focal
    moved = {
        "pitch": lambda: turned(rays, about=0),
        "yaw": lambda: turned(rays, about=1) - [SMALL, 0],
        "roll": lambda: turned(rays, about=2),
        "focal length": lambda: SMALL * rays,
        "radial": lambda: bent(rays, radial=1, decentering=(0, 0)),
        "across": lambda: bent(rays, radial=0, decentering=(1, 0)),
        "along": lambda: bent(rays, radial=0, decentering=(0, 1)),
    }[what]() * (PX / SMALL)
    orders = np.array([0, 1, 1, 2, 2, 3])  # of the places, which are in half widths
    coefficients = np.zeros(6)
    coefficients[term] = size * PX / TRUE.focal ** orders[term]
    curved = Bow(bow * coefficients[term], 0.0)
    eyes = replace(TRUE, coefficients=coefficients, bow=curved)
    np.testing.assert_allclose(eyes.rows_at(points), moved[:, 1], atol=1e-4 * PX)
    np.testing.assert_allclose(eyes.disparities_at(points), -moved[:, 0], atol=1e-4 * PX)


@pytest.mark.parametrize("seed", range(4))
def test_one_keyframe_tells_rows_to_a_fifth_of_a_pixel_and_ten_to_a_twelfth(seed: int) -> None:
    truth = TRUE.rows_at(CORNERS)
    for keyframes, limit in ((1, 0.25), (10, 0.08)):
        error = fitted(seed, keyframes).difference(SHAPE).rows_at(CORNERS) - truth
        assert np.sqrt(np.mean(error**2)) < limit


@pytest.mark.parametrize("seed", range(4))
def test_rows_tell_the_disparities_but_the_bow(seed: int) -> None:
    """Where decentering and yaw cancel along x, which is where the bow starts from."""
    truth = replace(TRUE, bow=Bow(0.0, 0.0)).disparities_at(CORNERS)
    eyes = fitted(seed, 10).difference(SHAPE)
    assert eyes.bow.px == 0 and eyes.bow.sigma == pytest.approx(1.2, rel=0.2)
    assert np.sqrt(np.mean((eyes.disparities_at(CORNERS) - truth) ** 2)) < 0.08
    assert np.sqrt(np.mean(truth**2)) > 0.25


def test_with_the_bow_that_structure_tells_nothing_is_left() -> None:
    fit, rng = fitted(0, 10), np.random.default_rng(1)
    for _ in range(40):
        fit.bow.learn(Bow(0.4 + 0.3 * rng.normal(), 0.15), fit.difference(SHAPE).bow)
    bow = fit.difference(SHAPE).bow
    assert abs(bow.px - 0.4) < 3 * bow.sigma < 0.3
    error = fit.difference(SHAPE).disparities_at(CORNERS) - TRUE.disparities_at(CORNERS)
    assert np.sqrt(np.mean(error**2)) < 0.1


@pytest.mark.parametrize("seed", range(8))
def test_of_a_pair_as_good_as_its_calibration_nothing_is_told(seed: int) -> None:
    eyes = fitted(seed, 10, np.zeros(6)).difference(SHAPE)
    assert eyes.told == 0 and eyes.bow.sigma == 0
    assert (eyes.disparities_at(CORNERS) == 0).all()


def test_where_nothing_is_known_the_calibration_holds() -> None:
    fit = EyeDifferenceFit(TRUE.focal)
    start = fit.difference(SHAPE)
    fit.learn(np.zeros(0), np.zeros(0), np.zeros((0, 3)), start)
    assert fit.empty and (fit.difference(SHAPE).rows_at(CORNERS) == 0).all()
    one = np.array([[40.0, 40.0, 3.0]])
    fit.learn(np.array([0.7]), np.array([200.0]), one, start)
    assert not fit.empty and np.abs(fit.coefficients).max() < 0.5, "one point is not believed all"
    assert fit.difference(SHAPE).told == 0
    before = fit.coefficients
    fit.learn(np.array([np.nan]), np.array([np.nan]), one, start)
    np.testing.assert_array_equal(fit.coefficients, before)


def test_a_rectification_that_changes_is_followed() -> None:
    fit, rng = fitted(0, 20), np.random.default_rng(5)
    for _ in range(80):
        fit.learn(*seen(rng, -TRUE.coefficients), fit.difference(SHAPE))
    error = fit.difference(SHAPE).rows_at(CORNERS) + TRUE.rows_at(CORNERS)
    assert np.abs(error).max() < 0.1


def test_no_pair_is_taken_to_differ_by_more_than_rectified_ones_do() -> None:
    far = replace(TRUE, coefficients=np.array([9.0, 0.0, 0.0, 9.0, 0.0, 0.0]))
    assert np.abs(far.rows_at(CORNERS)).max() <= 3.0
    assert np.abs(far.disparities_at(CORNERS)).max() <= 3.0
