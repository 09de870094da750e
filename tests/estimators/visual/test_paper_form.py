"""The paper's equations: right where they are, and as wrong as SPEC 1.1 says where they are not."""

from typing import Literal

import numpy as np
import pytest

from grouser.estimators.visual.paper_form import (
    PaperForm,
    PaperOnePoint,
    chord_errors,
    chords_of_points,
    turns_of_points,
)
from grouser.estimators.visual.planar import LevelledPoints, PlanarSolver
from grouser.geometry import Array
from grouser.rig import StereoCamera, camera_mount
from tests.estimators.visual.clouds import LEVEL, MOTIONS, MOUNTS, matched, near_zero, six, stereo

CAMERA = stereo(LEVEL)
NOISE = np.full(6, 0.15**2)
PRIOR = near_zero(1.0, 1.0, 1.0, 1.0)


def levelled(camera: StereoCamera, motion: Array, n: int = 64) -> LevelledPoints:
    matches = matched(np.random.default_rng(0), camera, motion, n=n)
    return PlanarSolver(camera).level(matches.reference, matches.current)


@pytest.mark.parametrize("turn_chord", MOTIONS.values(), ids=MOTIONS.keys())
def test_on_the_track_centre_its_equations_are_exact_once_the_sign_is_right(
    turn_chord: tuple[float, float],
) -> None:
    turn, chord = turn_chord
    points = levelled(CAMERA, six(turn, chord))
    np.testing.assert_allclose(turns_of_points(points), turn, atol=1e-9)
    chords = chords_of_points(points, turn, CAMERA.baseline, "fixed")
    np.testing.assert_allclose(chords, chord, atol=1e-9)
    errors = chord_errors(points, turn, np.array([chord, chord + 0.5]), CAMERA.baseline)
    np.testing.assert_allclose(errors, [[0.0] * 64, [0.5] * 64], atol=1e-9)


def test_the_printed_sign_adds_two_depths() -> None:
    """SPEC 1.1: printed less true is 2 (z cos(phi) - x sin(phi) - rho): metres."""
    points = levelled(CAMERA, six(0.06, 0.12))
    P = CAMERA.baseline / points.d[:, None] * points.q
    printed = chords_of_points(points, 0.06, CAMERA.baseline, "printed")
    expected = 2 * (P[:, 2] * np.cos(0.03) - P[:, 0] * np.sin(0.03) - 0.12)
    np.testing.assert_allclose(printed - 0.12, expected, atol=1e-9)
    assert (printed > 1.0).all()


def test_a_camera_ahead_of_the_track_centre_makes_turns_too_large() -> None:
    """By 2 a / (z + z'), SPEC 1.2."""
    points = levelled(stereo(camera_mount(0.2, 0.0, 0.4)), six(0.06, 0.12))
    z, z_ = CAMERA.fx * CAMERA.baseline / points.d, CAMERA.fx * CAMERA.baseline / points.d_
    expected = 2 * np.arctan(np.tan(0.03) * (1 + 0.4 / (z + z_)))
    np.testing.assert_allclose(turns_of_points(points), expected, atol=1e-9)


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
@pytest.mark.parametrize("turn_error", ["sampson", "ratio"])
def test_with_the_mount_known_every_mount_is_exact(
    mount: Array, turn_error: Literal["sampson", "ratio"]
) -> None:
    """Which part of the paper's error in spot turns is the camera's place: this is without it."""
    camera, form = stereo(mount), PaperForm(mount="known", turn_error=turn_error)
    for turn, chord in MOTIONS.values():
        matches = matched(np.random.default_rng(0), camera, six(turn, chord))
        solver = PaperOnePoint(form.camera(camera), form)
        found = solver.solve(matches, PRIOR, np.random.default_rng(1))
        assert found is not None and found.inliers.mean() > 0.9
        assert np.abs(found.motion - six(turn, chord)).max() < 1e-9


def test_the_form_takes_the_camera_to_the_track_centre_and_levels_it_if_asked() -> None:
    camera = stereo(camera_mount(0.2, 0.1, 0.4, pitch=0.2))
    for form, mount in (
        (PaperForm(), camera_mount(0.0, 0.0, 0.4, pitch=0.2)),
        (PaperForm(mount="ignored"), camera_mount(0.0, 0.0, 0.4)),
        (PaperForm(mount="known"), camera.T_base_camera),
    ):
        np.testing.assert_allclose(form.camera(camera).T_base_camera, mount, atol=1e-15)


@pytest.mark.parametrize("turn_error", ["sampson", "ratio"])
def test_a_third_of_the_points_may_be_wrong(turn_error: str) -> None:
    form = PaperForm(turn_error=turn_error)  # type: ignore[arg-type]
    errors = []
    for rng in np.random.default_rng(1).spawn(50):
        matches = matched(rng, CAMERA, six(0.03, 0.1), noise=NOISE, outliers=20)
        found = PaperOnePoint(CAMERA, form).solve(matches, PRIOR, rng)
        assert found is not None and found.inliers[20:].sum() > found.inliers[:20].sum()
        assert found.trials == 32 or found.inliers.sum() < 16
        errors.append(np.abs(found.motion[:2] - [0.03, 0.1]))
    turn, chord = np.median(errors, axis=0)
    assert turn < np.radians(0.3) and chord < 0.05


def test_as_printed_hardly_a_point_agrees_with_any_chord() -> None:
    for rng in np.random.default_rng(2).spawn(20):
        matches = matched(rng, CAMERA, six(0.03, 0.1), noise=NOISE)
        found = PaperOnePoint(CAMERA, PaperForm(chord_sign="printed")).solve(matches, PRIOR, rng)
        assert found is not None and found.inliers.sum() < 3 and found.motion[1] > 1.0


def test_the_generator_decides_and_nothing_else() -> None:
    matches = matched(np.random.default_rng(3), CAMERA, six(0.03, 0.1), noise=NOISE, outliers=20)

    def motion(seed: int) -> bytes:
        rng = np.random.default_rng(seed)
        found = PaperOnePoint(CAMERA, PaperForm()).solve(matches, PRIOR, rng)
        assert found is not None
        return found.motion.tobytes()

    assert motion(0) == motion(0)
    assert len({motion(seed) for seed in range(8)}) > 1


def test_without_points_or_disparities_there_is_no_hypothesis() -> None:
    matches = matched(np.random.default_rng(4), CAMERA, six(0.03, 0.1))
    solver, rng = PaperOnePoint(CAMERA, PaperForm()), np.random.default_rng(0)
    flat = np.array([1.0, 1.0, 0.0])
    for n, scale in ((0, np.ones(3)), (64, flat)):
        few = type(matches)(
            matches.reference[:n] * scale, matches.current[:n] * scale, matches.noise[:n], n
        )
        assert solver.solve(few, PRIOR, rng) is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"chord_sign": "minus"}, "chord_sign must be one of 'fixed', 'printed', got 'minus'"),
        ({"turn_error": "angle"}, "turn_error must be one of 'sampson', 'ratio', got 'angle'"),
        ({"mount": "flat"}, "mount must be one of 'levelled', 'ignored', 'known', got 'flat'"),
        ({"polar_radius": 0.0}, r"polar_radius must be positive, got 0\.0"),
        ({"hypotheses": -1}, "hypotheses must be positive, got -1"),
    ],
)
def test_what_is_no_form_is_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        PaperForm(**options)  # type: ignore[arg-type]
