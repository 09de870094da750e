"""One point gives turn and chord: exactly without noise, with an honest sigma under it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from grouser.estimators.visual.planar import ChassisTolerance, PlanarSolver
from grouser.geometry import Array
from grouser.rig import R_BASE_OPTICAL, StereoCamera, camera_mount
from tests.estimators.visual.clouds import (
    MOTIONS,
    MOUNTS,
    matched,
    moved,
    points_of,
    scattered,
    seen,
    six,
    stereo,
)

RIGID = ChassisTolerance()
NOISE = np.full((1, 6), 0.3**2)  # one row serves all points


def solved(camera: StereoCamera, reference: Array, current: Array) -> tuple[Array, Array]:
    """(n,) turns, and chords given the median turn."""
    solver = PlanarSolver(camera)
    points = solver.level(reference, current)
    turns, _ = solver.turns(points, NOISE, RIGID)
    chords, _ = solver.chords(points, float(np.median(turns)), NOISE, RIGID)
    return turns, chords


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS.keys())
@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
@pytest.mark.parametrize("fy", [260.0, 300.0])
def test_without_noise_every_point_gives_the_motion(
    mount: Array, motion: tuple[float, float], fy: float
) -> None:
    camera = stereo(mount, fy=fy)
    matches = matched(np.random.default_rng(0), camera, six(*motion), n=100, depth=(1.5, 9.0))
    turns, chords = solved(camera, matches.reference, matches.current)
    assert np.abs(turns - motion[0]).max() < 1e-9
    assert np.abs(chords - motion[1]).max() < 1e-9


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
def test_points_at_infinity_give_the_turn(mount: Array) -> None:
    camera, motion = stereo(mount), six(0.1, 0.2)
    matches = matched(np.random.default_rng(1), camera, motion, n=20, depth=(1e9, 1e10))
    matches.reference[:, 2] = matches.current[:, 2] = 0.0
    solver = PlanarSolver(camera)
    turns, sigmas = solver.turns(solver.level(matches.reference, matches.current), NOISE, RIGID)
    assert np.abs(turns - motion[0]).max() < 1e-8
    assert np.isfinite(sigmas).all()


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
def test_a_known_side_is_taken_into_account_exactly(mount: Array) -> None:
    camera, motion = stereo(mount), six(0.06, 0.3, -0.04)
    solver = PlanarSolver(camera)
    matches = matched(np.random.default_rng(7), camera, motion, n=100, depth=(1.5, 9.0))
    points = solver.level(matches.reference, matches.current)
    turns, _ = solver.turns(points, NOISE, RIGID, side=-0.04)
    chords, _ = solver.chords(points, 0.06, NOISE, RIGID)
    assert np.abs(turns - 0.06).max() < 1e-9
    assert np.abs(chords - 0.3).max() < 1e-9
    unaware, _ = solver.turns(points, NOISE, RIGID)
    assert np.abs(unaware - 0.06).min() > 1e-3


def eq_14(reference: Array, current: Array, camera: StereoCamera) -> Array:
    """The turn as the paper prints it."""
    U, V = (reference[:, :2] - [camera.cx, camera.cy]).T
    U_, V_ = (current[:, :2] - [camera.cx, camera.cy]).T
    return np.asarray(2 * np.arctan((U_ * V - U * V_) / (camera.fx * (V + V_))))


def test_eq_14_is_the_level_centred_case_whatever_the_noise() -> None:
    camera, rng = stereo(camera_mount(0.0, 0.1, 0.5)), np.random.default_rng(2)
    reference = seen(scattered(rng, 50, camera), camera)
    current = reference + rng.normal(0.0, 3.0, (50, 3))
    reference[:, 2] = current[:, 2] = 0.0  # without disparity the mix is v alone, as in the paper
    turns, _ = PlanarSolver(camera).turns(
        PlanarSolver(camera).level(reference, current), NOISE, RIGID
    )
    assert np.abs(turns - eq_14(reference, current, camera)).max() < 1e-12


def test_eq_14_overestimates_the_turn_of_a_camera_ahead_by_a_over_z() -> None:
    a, turn = 0.2, 0.02
    camera = stereo(camera_mount(a, 0.0, 0.4))
    points = np.array([[x, 0.4, z] for x in (-0.5, 0.1, 0.7) for z in (2.0, 4.0, 8.0)])
    now = moved(points, six(turn, 0.0), camera.T_base_camera)
    printed = eq_14(seen(points, camera), seen(now, camera), camera)
    excess = np.tan(printed / 2) / np.tan(turn / 2)
    np.testing.assert_allclose(excess, 1 + 2 * a / (points[:, 2] + now[:, 2]), atol=1e-12)
    assert excess[:3] - 1 == pytest.approx([0.10, 0.05, 0.025], rel=0.02)


def test_the_printed_sign_of_eq_16_gives_twice_the_depth() -> None:
    turn, chord = 0.05, 0.1
    camera = stereo()
    P = scattered(np.random.default_rng(3), 30, camera)
    P_ = moved(P, six(turn, chord), camera.T_base_camera)
    s, c = np.sin(turn / 2), np.cos(turn / 2)
    first, second = P @ [-s, 0.0, c], P_ @ [s, 0.0, c]
    _, chords = solved(camera, seen(P, camera), seen(P_, camera))
    np.testing.assert_allclose(chords, first - second, atol=1e-9)
    excess = first + second - chord
    np.testing.assert_allclose(excess, 2 * (first - chord), atol=1e-9)
    assert np.median(np.abs(excess) / (2 * P[:, 2])) == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
def test_exchanged_frames_give_the_opposite_motion_under_any_noise(mount: Array) -> None:
    solver, rng = PlanarSolver(stereo(mount)), np.random.default_rng(4)
    matches = matched(rng, stereo(mount), six(0.05, 0.1), n=50, noise=NOISE[0], depth=(0.8, 4.0))
    there = solver.level(matches.reference, matches.current)
    back = solver.level(matches.current, matches.reference)
    turn = solver.turns(there, NOISE, RIGID)[0]
    np.testing.assert_allclose(solver.turns(back, NOISE, RIGID)[0], -turn, atol=1e-12)
    np.testing.assert_allclose(
        solver.chords(back, -0.05, NOISE, RIGID)[0],
        -solver.chords(there, 0.05, NOISE, RIGID)[0],
        atol=1e-12,
    )


def correlated(rng: np.random.Generator, draws: int) -> Array:
    """(draws, 3) errors of u, v, d where uL, v and uR are each off by 0.3 px."""
    left, v, right = rng.normal(0.0, 0.3, (3, draws))
    return np.stack([left, v, left - right], axis=-1)


def independent(rng: np.random.Generator, draws: int) -> Array:
    """(draws, 3) independent errors of u, v and d; of d with twice the variance."""
    return np.asarray(rng.normal(size=(draws, 3)) * [0.3, 0.3, 0.3 * np.sqrt(2)])


@pytest.mark.parametrize(("errors", "bound"), [(independent, 0.06), (correlated, 0.17)])
@pytest.mark.parametrize("name", ["level on the centre line", "everything"])
def test_sigmas_agree_with_monte_carlo(
    name: str, errors: Callable[..., Array], bound: float
) -> None:
    """SPEC 1.4: to 5 % where |V| >= 20 px and u, d are independent, at worst 17 % where not."""
    rng, camera, draws = np.random.default_rng(5), stereo(MOUNTS[name]), 4000
    solver, motion, noise = PlanarSolver(camera), six(0.03, 0.1), 0.09 * np.array([[1, 1, 2] * 2])
    pixels = [(100, 80, 15.6), (100, 40, 15.6), (20, 60, 8.0), (-90, 25, 6.2), (-30, -50, 10.0)]
    for U, V, d in pixels:
        reference = np.array([[camera.cx + U, camera.cy + V, d]])
        current = seen(moved(points_of(reference, camera), motion, camera.T_base_camera), camera)
        _, turn_sigma = solver.turns(solver.level(reference, current), noise, RIGID)
        _, chord_sigma = solver.chords(solver.level(reference, current), 0.03, noise, RIGID)
        noisy = solver.level(reference + errors(rng, draws), current + errors(rng, draws))
        turns, _ = solver.turns(noisy, noise, RIGID)
        chords, _ = solver.chords(noisy, 0.03, noise, RIGID)
        assert turns.std() == pytest.approx(turn_sigma[0], rel=bound), (U, V, d)
        assert chords.std() == pytest.approx(chord_sigma[0], rel=bound), (U, V, d)


@pytest.mark.parametrize("name", ["roll", "pitch", "height"])
def test_what_leaves_the_plane_is_in_the_sigma(name: str) -> None:
    """A camera at the origin, whose place a tilt does not move; the mount may still be turned."""
    mount = MOUNTS["everything"].copy()
    mount[:3, 3] = 0.0
    camera, rng, sigma = stereo(mount), np.random.default_rng(6), 1e-5
    solver, exact = PlanarSolver(camera), np.zeros((1, 6))
    reference = seen(scattered(rng, 12, camera, depth=(1.0, 5.0)), camera)
    turns, chords = [], []
    for draw in sigma * rng.normal(size=1000):
        motion = replace_part(six(0.02, 0.05), name, draw)
        current = seen(moved(points_of(reference, camera), motion, mount), camera)
        points = solver.level(reference, current)
        turns.append(solver.turns(points, exact, RIGID)[0])
        chords.append(solver.chords(points, 0.02, exact, RIGID)[0])
    slack = replace(RIGID, **{name: sigma})
    flat = seen(moved(points_of(reference, camera), six(0.02, 0.05), mount), camera)
    points = solver.level(reference, flat)
    _, turn_sigma = solver.turns(points, exact, slack)
    _, chord_sigma = solver.chords(points, 0.02, exact, slack)
    np.testing.assert_allclose(np.std(turns, axis=0), turn_sigma, rtol=0.1)
    np.testing.assert_allclose(np.std(chords, axis=0), chord_sigma, rtol=0.1)


def replace_part(motion: Array, name: str, value: float) -> Array:
    """The motion (6,) with height, roll or pitch set."""
    changed = motion.copy()
    changed[["height", "roll", "pitch"].index(name) + 3] = value
    return changed


def printed_turns(
    reference: Array, current: Array, camera: StereoCamera, noise: Array, slack: ChassisTolerance
) -> tuple[Array, Array]:
    """SPEC 1.2's turns and, by differences of them, their sigmas (1.4)."""
    level = R_BASE_OPTICAL.T @ camera.T_base_camera[:3, :3]
    lever, baseline = camera.T_base_camera[0, 3] / camera.baseline, camera.baseline

    def rays(w: Array) -> Array:
        V = (w[:, 1] - camera.cy) * camera.fx / camera.fy
        return np.stack([w[:, 0] - camera.cx, V, np.full(len(w), camera.fx)], axis=-1) @ level.T

    q0, q0_ = rays(reference), rays(current)
    k1, k2 = (q0[:, 1] + q0_[:, 1]) / 2, (reference[:, 2] + current[:, 2]) / 4

    def solve(w: Array, w_: Array, tilt: Array, height: float) -> Array:
        q, q_, d, d_ = rays(w), rays(w_), w[:, 2], w_[:, 2]
        q_ = q_ + np.cross(tilt, q_) + np.outer(d_, [0.0, height / baseline, 0.0])
        m, m_ = k1 * q[:, 1] + k2 * d, k1 * q_[:, 1] + k2 * d_
        bottom = q_[:, 2] * m + q[:, 2] * m_ + lever * (m * d_ + m_ * d)
        return np.asarray(2 * np.arctan((q_[:, 0] * m - q[:, 0] * m_) / bottom))

    still, variance, step = np.zeros(3), np.zeros(len(reference)), 1e-5
    for k in range(3):
        by = step * np.eye(3)[k]
        before = solve(reference + by, current, still, 0) - solve(reference - by, current, still, 0)
        now = solve(reference, current + by, still, 0) - solve(reference, current - by, still, 0)
        variance += (before / (2 * step)) ** 2 * noise[:, k]
        variance += (now / (2 * step)) ** 2 * noise[:, 3 + k]
    for axis, sigma in ((0, slack.pitch), (2, slack.roll)):
        tilt = step * np.eye(3)[axis]
        change = solve(reference, current, tilt, 0) - solve(reference, current, -tilt, 0)
        variance += (change / (2 * step) * sigma) ** 2
    change = solve(reference, current, still, step) - solve(reference, current, still, -step)
    variance += (change / (2 * step) * slack.height) ** 2
    return solve(reference, current, still, 0), np.sqrt(variance)


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
def test_the_kernel_does_what_is_printed(mount: Array) -> None:
    camera, rng = stereo(mount, fy=250.0), np.random.default_rng(8)
    matches = matched(rng, camera, six(0.05, 0.1), n=30, noise=np.full(6, 0.1))
    noise = rng.uniform(0.01, 0.2, (30, 6))
    slack = ChassisTolerance(roll=0.002, pitch=0.004, height=0.006)
    solver = PlanarSolver(camera)
    turns, sigmas = solver.turns(solver.level(matches.reference, matches.current), noise, slack)
    expected, spread = printed_turns(matches.reference, matches.current, camera, noise, slack)
    np.testing.assert_allclose(turns, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(sigmas, spread, rtol=1e-5)
