"""Visual odometry over a drive: small and honest errors, darkness borne, bad input refused."""

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.base import Observation
from grouser.estimators.icr_predictor import IcrOptions
from grouser.estimators.slope import on_steep
from grouser.estimators.synthetic_drive import RIG, Drive, synthetic_drive
from grouser.estimators.visual import solvers
from grouser.estimators.visual.image_frontend import ImageFrontend
from grouser.estimators.visual.odometry import VisualOdometry
from grouser.estimators.visual.paper_form import PaperForm
from grouser.estimators.visual.prediction import Increment, ScaleOptions
from grouser.geometry import Array, between, project, wrap
from grouser.rig import Rig

FRAMES = 24
DARK = range(10, 26)
SOLVERS = list(solvers.SOLVERS)


def run(
    observations: Iterable[Observation], *, rig: Rig = RIG, tracks: bool = True, **options: Any
) -> list[PoseEstimate]:
    estimator = VisualOdometry(rig, **options)
    shown = [{k: v for k, v in o.items() if tracks or k != "tracks"} for o in observations]
    first = estimator.reset(shown[0], rng=np.random.default_rng(0))
    return [first, *(estimator.update(observation) for observation in shown[1:])]


def errors(estimates: list[PoseEstimate], drive: Drive) -> Array:
    """(n, 3) x, y, heading."""
    error = np.array([e.pose for e in estimates]) - drive.poses[: len(estimates)]
    error[:, 2] = wrap(error[:, 2])
    return np.asarray(error)


def drive(frames: int = FRAMES, blackout: range = range(0), seed: int = 0) -> Drive:
    return synthetic_drive(frames=frames, blackout=blackout, seed=seed)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("tracks", [True, False])
def test_the_error_is_below_a_percent_of_the_way(solver: str, tracks: bool) -> None:
    for seed in (0, 1):
        room = drive(seed=seed)
        estimates = run(room.observations, tracks=tracks, solver=solver)
        error, path = errors(estimates, room), 0.05 * (FRAMES - 1)
        assert np.abs(error[:, :2]).max() < 0.01 * path
        assert np.abs(error[:, 2]).max() < np.radians(0.2)
        assert {e.status for e in estimates} == {Status.TRACKING}
        assert not any(e.diagnostics["slipped"] for e in estimates[1:])


def test_where_the_tracks_say_where_to_look_one_look_is_enough(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each further search costs as much as the first; a vague prior of the side widens none. The
    first frame has a second one: nobody knows whether the tracks ran before, or rested."""
    looks, match = [], ImageFrontend.match

    def counted(self: ImageFrontend, *seen: Any) -> Any:
        looks.append(seen)
        return match(self, *seen)

    monkeypatch.setattr(ImageFrontend, "match", counted)
    run(drive().observations)
    assert len(looks) == FRAMES


@pytest.mark.parametrize(("quality", "fewest", "most"), [("fast", 20, 40), ("high", 80, 200)])
def test_quality_says_how_many_points_are_used(quality: str, fewest: int, most: int) -> None:
    matches = [e.diagnostics["matches"] for e in run(drive(4).observations, quality=quality)[1:]]
    assert fewest < min(matches) and max(matches) <= most


def test_explicit_options_override_the_quality() -> None:
    room = drive(4)
    estimates = run(room.observations, quality="fast", max_points=64, corners=900)
    expected = run(room.observations)
    assert [e.pose.tobytes() for e in estimates] == [e.pose.tobytes() for e in expected]


def test_the_stages_are_parts_of_the_update() -> None:
    """However busy the machine: their times are not negative and do not exceed the whole."""
    room, estimator = drive(8), VisualOdometry(RIG)
    estimator.reset(room.observations[0], rng=np.random.default_rng(0))
    for observation in room.observations[1:]:
        started = time.perf_counter()
        diagnostics = estimator.update(observation).diagnostics
        whole = 1e3 * (time.perf_counter() - started)
        stages = [value for name, value in diagnostics.items() if name.startswith("ms_")]
        assert len(stages) == 5 and min(stages) >= 0 and sum(stages) <= whole


def test_a_rig_without_tracks_ignores_them() -> None:
    room = drive(8)
    bare = run(room.observations, rig=replace(RIG, tracks=None))
    unseen = run(room.observations, tracks=False)
    for one, other in zip(bare, unseen, strict=True):
        np.testing.assert_array_equal(one.pose, other.pose)


def test_tracks_that_shall_not_be_used_are_not_even_read() -> None:
    room = drive(8)
    broken = [{**o, "tracks": np.full(2, np.nan)} for o in room.observations]
    unseen = run(room.observations, tracks=False)
    for one, other in zip(run(broken, use_tracks=False), unseen, strict=True):
        np.testing.assert_array_equal(one.pose, other.pose)


@pytest.mark.parametrize("solver", SOLVERS)
def test_frame_to_frame_compares_neighbours(solver: str) -> None:
    room = drive()
    estimates = run(room.observations, frame_to_frame=True, solver=solver)
    assert {e.diagnostics["keyframe_age"] for e in estimates[1:]} == {1.0}
    error = errors(estimates, room)
    assert np.abs(error[:, :2]).max() < 0.02 and np.abs(error[:, 2]).max() < np.radians(0.4)


def test_frame_to_frame_bridges_a_dark_frame_from_the_last_one_seen() -> None:
    room = drive(14, range(8, 10))
    ages = [e.diagnostics["keyframe_age"] for e in run(room.observations, frame_to_frame=True)[1:]]
    assert ages[6:12] == [1.0, 1.0, 2.0, 3.0, 1.0, 1.0]


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_planar_refinement_stays_on_the_plane(solver: str) -> None:
    room = drive()
    estimates = run(room.observations, refinement="planar", solver=solver)
    for estimate in estimates:
        assert estimate.pose_3d is not None
        assert np.abs(estimate.pose_3d[2, [0, 1, 3]]).max() < 1e-4
    error = errors(estimates, room)
    assert np.abs(error[:, :2]).max() < 0.012 and np.abs(error[:, 2]).max() < np.radians(0.2)


def test_a_refinement_on_an_arc_never_slips_sideways() -> None:
    """From frame to frame every increment is the chord of an arc."""
    room = drive()
    poses = np.array([e.pose for e in run(room.observations, refinement="arc", tracks=False)])
    assert np.abs(between(room.poses, poses)[:, :2]).max() < 0.02


@pytest.mark.parametrize("turn_error", ["sampson", "ratio"])
def test_one_point_may_judge_turns_otherwise(turn_error: str) -> None:
    room = drive()
    error = errors(run(room.observations, turn_error=turn_error), room)
    assert np.abs(error[:, :2]).max() < 0.012 and np.abs(error[:, 2]).max() < np.radians(0.2)


def test_the_paper_s_form_follows_the_drive_but_for_the_place_of_its_camera() -> None:
    """0.15 m ahead of the track centre, which it ignores; with the sign as printed it is blind."""
    room = drive()
    error = errors(run(room.observations, paper=True), room)
    assert np.abs(error[:, :2]).max() < 0.06 and np.abs(error[:, 2]).max() < np.radians(2.0)
    printed = run(room.observations, paper=PaperForm(chord_sign="printed"))
    assert {e.status for e in printed[1:]} == {Status.COASTING}


def test_at_rest_the_pose_stays_within_a_millimetre() -> None:
    """Other noise in every image, and no motion."""
    rng, first = np.random.default_rng(1), drive(2).observations[0]
    still = []
    for index in range(16):
        eyes = {
            eye: (first[eye] + rng.normal(0, 1, first[eye].shape))
            .round()
            .clip(0, 255)
            .astype(np.uint8)
            for eye in ("left", "right")
        }
        still.append({**eyes, "stamp": np.array([0.1 * index])})
    poses = np.array([e.pose for e in run(still)])
    assert np.abs(poses[:, :2]).max() < 1e-3 and np.abs(poses[:, 2]).max() < np.radians(0.05)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_blackout_with_tracks_is_coasted_through(solver: str) -> None:
    room = drive(34, DARK)
    estimates = run(room.observations, solver=solver)
    statuses = [e.status for e in estimates]
    coasted = range(DARK.start, DARK.stop + 1)  # the first bright frame has no bright keyframe
    assert statuses == [Status.COASTING if i in coasted else Status.TRACKING for i in range(34)]
    before, after = estimates[DARK.start - 1], estimates[DARK.stop - 1]
    grown = np.diag(after.covariance) / np.diag(before.covariance)
    assert (grown > 2).all()
    error = errors(estimates, room)
    assert np.abs(error[-1, :2]).max() < 0.05 and abs(error[-1, 2]) < 0.05
    assert error[-1] @ np.linalg.solve(estimates[-1].covariance, error[-1]) < 16.3


def test_the_dark_goes_on_from_where_the_robot_was_last_seen() -> None:
    """With the tilt that was seen then, and with what one frame makes unsure, though the keyframe
    may be several frames old."""
    room = drive(13, range(9, 13))
    before, dark, last = (run(room.observations)[i] for i in (8, 9, 12))
    assert before.diagnostics["keyframe_age"] > 1 and before.pose_3d is not None
    for estimate in (dark, last):
        assert estimate.status == Status.COASTING and estimate.pose_3d is not None
        np.testing.assert_allclose(estimate.pose_3d[:3, 2], before.pose_3d[:3, 2], atol=1e-12)
        np.testing.assert_allclose(project(estimate.pose_3d), estimate.pose, atol=1e-3)
    assert np.abs(before.pose_3d[:2, 2]).max() > 1e-6
    first, whole = (np.diag(e.covariance - before.covariance) for e in (dark, last))
    assert (0 < first).all() and (first < 0.4 * whole).all()


def test_tracks_are_less_sure_on_the_slope_that_was_last_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    room, verticals, sigmas = drive(16, range(9, 16)), list[Array](), []

    def spied(
        increment: Increment, vertical: Array, *, steeper: float, **options: Any
    ) -> Increment:
        verticals.append(vertical.copy())
        return on_steep(increment, vertical + [steeper, 0.0, 0.0], **options)

    for steeper in (0.0, 0.1):
        spy = partial(spied, steeper=steeper)
        monkeypatch.setattr("grouser.estimators.visual.odometry.on_steep", spy)
        estimates = run(room.observations)
        sigmas.append(np.sqrt(np.diag(estimates[-1].covariance)))
    assert (sigmas[1] > 1.1 * sigmas[0]).all()
    seen = np.array([e.pose_3d[2, :3] for e in estimates if e.pose_3d is not None])
    given = np.array(verticals[-15:])
    np.testing.assert_allclose(given[:9], seen[:9], atol=1e-12)
    steep_in_the_dark = np.hypot(*given[9:, :2].T)
    np.testing.assert_allclose(steep_in_the_dark, np.hypot(*seen[8, :2]), rtol=1e-6)


def test_a_scale_error_of_the_tracks_is_found_before_it_is_needed() -> None:
    """Tracks that report six per cent too much, then darkness in which nothing else is left."""
    room = drive(37, range(25, 37))
    wrong = [{**o, "tracks": 1.06 * o["tracks"]} for o in room.observations]
    learnt = run(wrong)[-1].pose - room.poses[-1]
    trusting = run(wrong, slip_states=ScaleOptions(track_sigma=1e-6, turn_sigma=1e-6))
    believed = trusting[-1].pose - room.poses[-1]
    assert np.linalg.norm(believed[:2]) > 0.03
    assert np.linalg.norm(learnt[:2]) < 0.5 * np.linalg.norm(believed[:2])


def test_a_blackout_without_tracks_is_lost_after_a_second_and_found_again() -> None:
    room = drive(34, DARK)
    estimates = run(room.observations, tracks=False)
    stamps = np.array([e.stamp for e in estimates])
    dark = stamps - stamps[DARK.start - 1]
    for i in DARK:
        expected = Status.LOST if dark[i] > 1.0 + 1e-9 else Status.COASTING
        assert estimates[i].status == expected, i
    assert {e.status for e in estimates[DARK.stop + 2 :]} == {Status.TRACKING}
    step = between(estimates[-2].pose, estimates[-1].pose)
    truth = between(room.poses[-2], room.poses[-1])
    assert np.abs(step - truth).max() < 0.01, "it measures motion again"


def test_lost_after_is_an_option() -> None:
    room = drive(34, DARK)
    estimates = run(room.observations, tracks=False, lost_after=0.45)
    assert estimates[DARK.start + 3].status == Status.COASTING
    assert estimates[DARK.start + 4].status == Status.LOST


def test_colour_images_give_nearly_the_same_poses() -> None:
    room = drive(10)
    coloured = [
        {**o, **{eye: np.repeat(o[eye], 3, axis=2) for eye in ("left", "right")}}
        for o in room.observations
    ]
    for grey, colour in zip(run(room.observations), run(coloured), strict=True):
        np.testing.assert_allclose(grey.pose, colour.pose, atol=1e-9)


def test_pose_3d_agrees_with_the_pose_and_stays_near_the_plane() -> None:
    for tracks in (True, False):
        for estimate in run(drive().observations, tracks=tracks):
            assert estimate.pose_3d is not None
            flat = project(estimate.pose_3d)
            assert np.abs(flat - estimate.pose).max() < 0.01
            assert abs(estimate.pose_3d[2, 3]) < 0.03
            np.testing.assert_allclose(
                estimate.pose_3d[:3, :3] @ estimate.pose_3d[:3, :3].T, np.eye(3), atol=1e-12
            )


def test_diagnostics_tell_matches_inliers_and_milliseconds() -> None:
    last = run(drive(4).observations)[-1].diagnostics
    assert last["features"] > last["candidates"] > last["matches"] >= last["inliers"] > 30
    stages = ("ms_stereo", "ms_matching", "ms_ransac", "ms_refinement", "ms_filter")
    assert all(last[stage] > 0 for stage in stages)


def test_the_registered_names_choose_the_solver() -> None:
    room = drive(6)
    for name, solver in (("one-point-ransac", "one-point"), ("five-point-ransac", "five-point")):
        estimator = make(name, RIG)
        estimator.reset(room.observations[0], rng=np.random.default_rng(0))
        poses = [estimator.update(o).pose for o in room.observations[1:]]
        expected = [e.pose for e in run(room.observations, solver=solver)[1:]]
        np.testing.assert_array_equal(poses, expected)


@pytest.mark.parametrize(
    ("construct", "words"),
    [
        (
            lambda: VisualOdometry(RIG, solver="six-point"),
            "no solver is named 'six-point'; known: disparity-space, five-point, ",
        ),
        (
            lambda: VisualOdometry(Rig(dt=0.1)),
            r"visual odometry needs rig\.stereo, and this rig has None",
        ),
        (
            lambda: VisualOdometry(RIG, refinement="flat"),  # type: ignore[arg-type]
            "refinement must be one of 'spatial', 'planar', 'arc', got 'flat'",
        ),
        (
            lambda: VisualOdometry(RIG, solver="two-point", paper=True),
            "solver must be one of 'one-point', got 'two-point'",
        ),
        (
            lambda: VisualOdometry(RIG, slip_states=IcrOptions(), paper=True),
            r"paper=\.\.\. has ScaleOptions as slip_states, not IcrOptions\(",
        ),
        (
            lambda: VisualOdometry(RIG, turn_error="cosine"),  # type: ignore[arg-type]
            "turn_error must be one of 'sigmas', 'sampson', 'ratio', got 'cosine'",
        ),
        (
            lambda: VisualOdometry(RIG, solver="two-point", turn_error="ratio"),
            "turn_error='ratio' is for solver 'one-point', not for 'two-point'",
        ),
        (
            lambda: VisualOdometry(RIG, quality="best"),
            "quality must be one of 'fast', 'standard', 'high', got 'best'",
        ),
        (
            lambda: VisualOdometry(RIG, features="surf"),
            "features must be one of 'fast', 'sift', got 'surf'",
        ),
        (
            lambda: VisualOdometry(RIG, max_points=5),
            "max_points must be a whole number of at least 12, got 5",
        ),
        (
            lambda: VisualOdometry(RIG, corners=900.5),  # type: ignore[arg-type]
            r"corners must be a whole number of at least 12, got 900\.5",
        ),
        (
            lambda: VisualOdometry(RIG, lost_after=-1.0),
            r"lost_after must be positive and finite, got -1\.0",
        ),
    ],
)
def test_what_cannot_be_built_is_refused(construct: Callable[[], object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        construct()


def test_an_update_before_the_reset_is_refused() -> None:
    with pytest.raises(RuntimeError, match=r"call reset\(\) with the first observation before upd"):
        VisualOdometry(RIG).update(drive(2).observations[0])


@pytest.mark.parametrize("bad", [(240, 320), (240, 320, 2)])
def test_an_image_of_another_shape_is_refused(bad: tuple[int, ...]) -> None:
    seen = dict(drive(2).observations[0])
    seen["right"] = np.zeros(bad, dtype=np.uint8)
    with pytest.raises(ValueError, match=r"observation 'right' must be \(H, W, 1\)"):
        VisualOdometry(RIG).reset(seen, rng=np.random.default_rng(0))


@pytest.mark.parametrize("eye", ["left", "right"])
@pytest.mark.parametrize("frame", [0, 1])
def test_an_image_of_another_size_than_the_calibration_is_refused(eye: str, frame: int) -> None:
    """Half the size would halve all distances; a right image that is taller has no row there."""
    first, second = (dict(observation) for observation in drive(2).observations)
    (first, second)[frame][eye] = np.zeros((480, 320, 1), dtype=np.uint8)
    estimator, rng = VisualOdometry(RIG), np.random.default_rng(0)
    words = rf"observation '{eye}' is 320 x 480 px, but rig.stereo is calibrated for 320 x 240"
    if frame == 0:
        with pytest.raises(ValueError, match=words):
            estimator.reset(first, rng=rng)
    else:
        estimator.reset(first, rng=rng)
        with pytest.raises(ValueError, match=words):
            estimator.update(second)
