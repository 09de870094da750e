"""The filter of tracks and relative vision: honest on its own model, and it knows who is right."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from grouser.estimators.track_motion import SideSlip, TrackNoise, arc_pose, chord, track_increment
from grouser.estimators.visual.fusion import (
    SLIP_GATE,
    Accumulated,
    RelativeFilter,
    RelativePose,
    nothing_yet,
)
from grouser.estimators.visual.prediction import ScaleOptions, TrackPredictor
from grouser.geometry import Array, between, compose, wrap
from grouser.rig import TrackGeometry

WIDTH, TURN_NOISE, WALK = 0.5, 0.05, 5e-4
OFFSET_SIGMA = 0.3
NOISE, SLIP = TrackNoise(), SideSlip()
TRACKS = TrackGeometry(gauge=0.4, width=0.08, effective_width=WIDTH)
PREDICTOR = TrackPredictor(
    TRACKS, ScaleOptions(walk=WALK, turn_noise=TURN_NOISE, transient_noise=0.0)
)
ERRORS = PREDICTOR.errors
SIGMAS = np.append(ERRORS.sigmas, OFFSET_SIGMA)
VISION = np.diag([0.002, 0.002, 0.001]) ** 2
DRIVE = np.array(
    [[0.04, 0.06]] * 30 + [[0.06, 0.05]] * 30 + [[-0.05, -0.04]] * 30 + [[0.05, 0.05]] * 30
)


def predicted(frames: int, start: int = 0, biases: Array | None = None) -> Accumulated:
    """What the tracks say of so many frames of the drive."""
    known, total = np.zeros(len(ERRORS)) if biases is None else biases, nothing_yet(ERRORS)
    for du in DRIVE[start : start + frames]:
        total = total.then(PREDICTOR.predict({"tracks": du}, known))
    return total


def vision(pose: Array, offset: float = 0.0) -> RelativePose:
    """A measurement of a relative pose whose distances an offset makes too long."""
    by_disparity = np.append(0.05 * pose[:2], 0.0)
    return RelativePose(pose + offset * by_disparity, VISION, by_disparity)


def make(*, scale: float = 1.0, offset: float = OFFSET_SIGMA) -> RelativeFilter:
    """scale: of the sigmas of the tracks' constant errors."""
    errors = replace(ERRORS, sigmas=scale * ERRORS.sigmas)
    return RelativeFilter(errors, disparity_sigma=offset)


def exact() -> RelativeFilter:
    """One that takes the tracks and the cameras for calibrated."""
    return make(scale=0.0, offset=0.0)


def true_step(rng: np.random.Generator, du: Array, biases: Array) -> Array:
    """The increment (3,) of tracks that report `du`, drawn from the predictor's model."""
    actual = du * (1 + biases[:2])
    actual = actual + np.sqrt(np.diag(NOISE.covariance(actual))) * rng.normal(size=2)
    turn, arc_length = track_increment(actual, WIDTH)
    turn *= 1 + biases[2] + TURN_NOISE * rng.normal()
    step = arc_pose(turn, arc_length)
    length = chord(turn, arc_length)
    side = biases[3] * length + SLIP.sigma(turn, length) * rng.normal()
    return np.asarray(step + side * np.array([-np.sin(turn / 2), np.cos(turn / 2), 0.0]))


@dataclass
class Outcome:
    pose_error: Array
    bias_error: Array
    covariance: Array


def simulate(rng: np.random.Generator, keyframe_frames: int = 6) -> Outcome:
    """The drive once, with biases, noise and keyframes."""
    kalman, truth, keyframe = make(), np.zeros(3), np.zeros(3)
    biases, since = SIGMAS * rng.normal(size=5), nothing_yet(ERRORS)
    for frame, du in enumerate(DRIVE, start=1):
        truth = compose(truth, true_step(rng, du, biases))
        since = since.then(PREDICTOR.predict({"tracks": du}, kalman.of_predictor()[0]))
        biases[:4] += WALK * rng.normal(size=4)
        if frame % keyframe_frames == 0:
            seen = vision(between(keyframe, truth), biases[4])
            noisy = RelativePose(
                seen.pose + np.sqrt(np.diag(VISION)) * rng.normal(size=3), VISION, seen.by_disparity
            )
            kalman.commit(kalman.fuse(since, noisy))
            keyframe, since = truth, nothing_yet(ERRORS)
    state = kalman.keyframe
    error = truth - state.pose
    error[2] = wrap(error[2])
    return Outcome(error, biases - state.biases, state.covariance)


def test_nees_of_the_pose_is_three_and_the_scale_errors_are_found() -> None:
    outcomes = [simulate(rng) for rng in np.random.default_rng(0).spawn(120)]
    nees = [o.pose_error @ np.linalg.solve(o.covariance[:3, :3], o.pose_error) for o in outcomes]
    joint = [np.append(o.pose_error, o.bias_error) for o in outcomes]
    joint_nees = [
        e @ np.linalg.solve(o.covariance, e) for e, o in zip(joint, outcomes, strict=True)
    ]
    assert 2.2 < np.mean(nees) < 4.0  # the mean of 120 has a sigma of 0.22
    assert 6.7 < np.mean(joint_nees) < 9.5  # eight
    found = np.std([o.bias_error for o in outcomes], axis=0)
    assert (found[:2] < 0.35 * SIGMAS[:2]).all() and (found[2:4] < 0.7 * SIGMAS[2:4]).all()
    said = np.sqrt(np.mean([np.diag(o.covariance)[3:] for o in outcomes], axis=0))
    np.testing.assert_allclose(found, said, rtol=0.25)


def through_the_dark(rng: np.random.Generator) -> Outcome:
    """Six frames in sight of a keyframe, six in the dark, and six in sight of where they led."""
    kalman, truth, keyframe = make(), np.zeros(3), np.zeros(3)
    biases, since, start = SIGMAS * rng.normal(size=5), nothing_yet(ERRORS), None
    for frame in range(1, 19):
        du = np.array([0.06, 0.05])
        truth = compose(truth, true_step(rng, du, biases))
        since = since.then(PREDICTOR.predict({"tracks": du}, kalman.of_predictor()[0]))
        if frame in (6, 18):
            told = vision(between(keyframe, truth), biases[4])
            noise = np.sqrt(np.diag(VISION)) * rng.normal(size=3)
            fused = kalman.fuse(since, RelativePose(told.pose + noise, VISION, told.by_disparity))
            start, since = fused.state, nothing_yet(ERRORS)
        if frame == 12:
            fused = kalman.coast(since, start)
        if frame in (12, 18):
            kalman.commit(fused)
            keyframe, since = truth, nothing_yet(ERRORS)
    error = truth - kalman.keyframe.pose
    error[2] = wrap(error[2])
    return Outcome(error, biases - kalman.keyframe.biases, kalman.keyframe.covariance)


def test_what_the_light_tells_of_the_dark_is_honest() -> None:
    """Coasting leads on from the last sight, so its error is what tracks brought since, and no more
    of it is taken back than that."""
    outcomes = [through_the_dark(rng) for rng in np.random.default_rng(5).spawn(150)]
    joint = [np.append(o.pose_error, o.bias_error) for o in outcomes]
    nees = [e @ np.linalg.solve(o.covariance, e) for e, o in zip(joint, outcomes, strict=True)]
    assert 6.0 < np.mean(nees) < 9.3  # of eight; slip in the dark is trusted less
    turned = np.sqrt(np.mean([o.pose_error[2] ** 2 for o in outcomes]))
    said = np.sqrt(np.mean([o.covariance[2, 2] for o in outcomes]))
    assert 0.7 * said < turned < 1.15 * said


def after_another_ground(rng: np.random.Generator) -> Outcome:
    """Straight on, where the tracks' constant errors change once by three sigmas; from then on,
    three keyframes in four are seen badly."""
    kalman, truth, keyframe = make(offset=0.0), np.zeros(3), np.zeros(3)
    biases, since, du = np.zeros(5), nothing_yet(ERRORS), np.array([0.05, 0.05])
    for frame in range(1, 97):
        if frame == 40:
            biases[:4] = 3 * SIGMAS[:4] * rng.choice([-1, 1], 4)
        truth = compose(truth, true_step(rng, du, biases))
        since = since.then(PREDICTOR.predict({"tracks": du}, kalman.of_predictor()[0]))
        badly = frame > 40 and (frame // 6) % 4 > 0
        noise = (100.0 if badly else 1.0) * VISION
        pose = between(keyframe, truth) + np.sqrt(np.diag(noise)) * rng.normal(size=3)
        seen = RelativePose(pose, noise, np.zeros(3))
        fused = kalman.fuse(since, seen)
        kalman.believe(fused, seen, since.frames)
        if frame % 6 == 0:
            kalman.commit(fused)
            keyframe, since = truth, nothing_yet(ERRORS)
    error = truth - kalman.keyframe.pose
    error[2] = wrap(error[2])
    return Outcome(error, biases - kalman.keyframe.biases, kalman.keyframe.covariance)


def test_tracks_that_slipped_are_no_measure_until_they_are_seen_to_be_one() -> None:
    outcomes = [after_another_ground(rng) for rng in np.random.default_rng(3).spawn(60)]
    nees = [o.pose_error @ np.linalg.solve(o.covariance[:3, :3], o.pose_error) for o in outcomes]
    assert 2.0 < np.mean(nees) < 5.0
    side = np.array([o.bias_error[3] for o in outcomes])
    said = np.sqrt([o.covariance[6, 6] for o in outcomes])
    assert np.sqrt(np.mean(side**2)) < SIGMAS[3] and np.mean((side / said) ** 2) < 3.0


def test_accumulation_is_composition_with_derivatives_by_the_biases() -> None:
    total, h = predicted(20, start=20), 1e-6
    pose = np.zeros(3)
    for du in DRIVE[20:40]:
        pose = compose(pose, PREDICTOR.predict({"tracks": du}, np.zeros(4)).pose)
    np.testing.assert_allclose(total.pose, pose, atol=1e-15)
    assert total.frames == 20
    for k in range(4):
        step = h * np.eye(4)[k]
        ahead, back = (predicted(20, 20, biases).pose for biases in (step, -step))
        assert np.abs(total.by_biases[:, k] - (ahead - back) / (2 * h)).max() < 1e-8


def test_without_biases_the_update_is_the_weighted_mean() -> None:
    """From a keyframe known exactly, two independent measurements add their information."""
    tracks = predicted(10)
    seen = vision(tracks.pose + [0.001, -0.002, 0.001])
    fused = exact().fuse(tracks, seen)
    of_tracks, of_vision = np.linalg.inv(tracks.covariance), np.linalg.inv(VISION)
    P = np.linalg.inv(of_tracks + of_vision)
    np.testing.assert_allclose(fused.state.covariance[:3, :3], P, rtol=1e-9, atol=1e-15)
    mean = P @ (of_tracks @ tracks.pose + of_vision @ seen.pose)
    np.testing.assert_allclose(fused.state.pose, mean, atol=1e-12)


def test_a_jump_beyond_the_gate_is_slip_and_vision_wins() -> None:
    kalman, tracks = make(), predicted(5)
    agreeing = kalman.fuse(tracks, vision(tracks.pose))
    assert not agreeing.slipped and agreeing.nis < 1e-6
    stuck = kalman.fuse(tracks, vision(np.array([0.0, 0.0, 0.3])))
    assert stuck.slipped and stuck.nis > SLIP_GATE
    sigma = np.sqrt(np.diag(VISION))
    assert (np.abs(stuck.state.pose - [0.0, 0.0, 0.3]) < 3 * sigma + 0.01).all()


def test_coasting_is_prediction_trusted_less_and_less() -> None:
    kalman = exact()
    traces = [np.trace(kalman.coast(predicted(n)).state.covariance) for n in range(1, 20)]
    assert (np.diff(traces) > 0).all()
    tracks, coasted = predicted(8), kalman.coast(predicted(8))
    np.testing.assert_allclose(coasted.state.pose, tracks.pose)
    np.testing.assert_allclose(coasted.state.covariance[:3, :3], tracks.covariance, atol=1e-15)
    assert np.isnan(coasted.nis) and not coasted.slipped


@pytest.mark.parametrize("keyframes", [1, 12])
def test_slip_may_end_where_nobody_sees_it(keyframes: int) -> None:
    """One track slid by half before the dark: by none of it in the dark, the truth is not beyond
    belief, however many keyframes that takes; what is no more than an error of scale is known."""
    sliding, scaled = make(), make()
    sure = np.diag(np.full(3 + len(SIGMAS), 1e-12))
    for kalman, scale in ((sliding, -0.5), (scaled, -0.05)):
        biases = np.array([0.0, scale, 0.0, 0.0, 0.0])
        kalman.keyframe = replace(kalman.keyframe, biases=biases, covariance=sure)
    truth = np.zeros(3)
    for _ in range(keyframes):
        truth = compose(truth, predicted(3).pose)
        for kalman in (sliding, scaled):
            kalman.commit(kalman.coast(predicted(3, biases=kalman.of_predictor()[0])))
    error = truth - sliding.keyframe.pose
    error[2] = wrap(error[2])
    assert error @ np.linalg.solve(sliding.keyframe.covariance[:3, :3], error) < SLIP_GATE
    assert abs(error[2]) > 10 * np.sqrt(scaled.keyframe.covariance[2, 2])


def test_tracks_that_were_seen_to_be_exact_are_trusted_more_in_the_dark() -> None:
    kalman, straight, known = exact(), np.array([0.05, 0.05]), np.zeros(len(ERRORS))
    for _ in range(12):
        since = nothing_yet(ERRORS)
        for _ in range(8):
            since = since.then(PREDICTOR.predict({"tracks": straight}, known))
            seen = vision(since.pose)
            fused = kalman.fuse(since, seen)
            kalman.believe(fused, seen, since.frames)
        kalman.commit(fused)
    kalman.keyframe = exact().keyframe
    before, after = (k.coast(since).state.covariance for k in (exact(), kalman))
    assert after[2, 2] < 0.3 * before[2, 2], "the tracks' own noise turns the robot"
    assert after[1, 1] > 0.3 * before[1, 1], "nobody knows how it slips in the dark"


def test_what_is_not_believed_says_nothing_of_the_tracks() -> None:
    kalman, tracks = exact(), [predicted(n) for n in range(1, 9)]
    for k, since in enumerate(tracks):
        mistaken = vision(since.pose + [0.0, 0.0, 0.1 * (-1) ** k])
        assert kalman.fuse(since, mistaken).slipped
    kalman.commit(kalman.coast(tracks[-1]))
    kalman.keyframe = exact().keyframe
    once, never = (k.coast(tracks[-1]).state.covariance for k in (kalman, exact()))
    np.testing.assert_array_equal(once, never)


def test_tracks_that_slipped_of_late_are_trusted_less_in_the_dark() -> None:
    rng, kalman = np.random.default_rng(5), exact()
    first = np.trace(kalman.coast(predicted(6)).state.covariance)
    for _ in range(12):
        tracks = predicted(6)
        off = rng.normal(0, [0.01, 0.01, 0.2])
        kalman.commit(kalman.fuse(tracks, vision(tracks.pose + off)))
    kalman.keyframe = exact().keyframe
    assert np.trace(kalman.coast(predicted(6)).state.covariance) > 5 * first


def test_following_takes_the_pose_of_vision_and_its_noise() -> None:
    kalman = make()
    kalman.commit(kalman.fuse(predicted(6), vision(predicted(6).pose)))
    step = np.array([0.1, 0.02, 0.05])
    before = kalman.keyframe
    followed = kalman.follow(vision(step), 3).state
    offset = before.biases[4]
    expected = compose(before.pose, step - offset * np.append(0.05 * step[:2], 0.0))
    np.testing.assert_allclose(followed.pose, expected, atol=1e-12)
    assert (np.diag(followed.covariance)[:3] > np.diag(before.covariance)[:3]).all()
    certain = exact().follow(vision(step), 1).state
    np.testing.assert_allclose(certain.covariance[:3, :3], VISION, atol=1e-15)


def test_a_common_disparity_offset_does_not_average_out() -> None:
    """Over n keyframes independent noise grows with sqrt(n), an offset's error with n."""
    ahead, kalman, spread = np.array([0.25, 0.0, 0.0]), make(scale=0.0), list[float]()
    for _ in range(100):
        kalman.commit(kalman.follow(vision(ahead), 5))
        spread.append(np.sqrt(kalman.keyframe.covariance[0, 0]))
    assert spread[99] == pytest.approx(0.3 * 0.05 * 25.0, rel=0.05)
    assert spread[99] / spread[49] > 1.95


def test_the_heading_may_pass_half_a_turn() -> None:
    kalman = make()
    around = np.array([0.0, 0.0, np.pi - 0.001])
    kalman.commit(kalman.follow(RelativePose(around, VISION, np.zeros(3)), 1))
    tracks = predicted(4)
    fused = kalman.fuse(tracks, vision(tracks.pose))
    assert fused.nis < 1e-6
    assert fused.state.pose[2] == pytest.approx(wrap(np.pi - 0.001 + tracks.pose[2]))
    np.testing.assert_allclose(kalman.relative(fused), tracks.pose, atol=1e-9)


def test_the_covariance_stays_one_over_a_thousand_frames() -> None:
    rng, kalman, since = np.random.default_rng(1), make(), nothing_yet(ERRORS)
    for frame in range(1000):
        du = rng.uniform(-0.1, 0.1, 2)
        since = since.then(PREDICTOR.predict({"tracks": du}, kalman.of_predictor()[0]))
        seen = vision(since.pose + 0.002 * rng.normal(size=3))
        fused = kalman.coast(since) if frame % 7 == 0 else kalman.fuse(since, seen)
        P = fused.state.covariance
        np.testing.assert_array_equal(P, P.T)
        assert np.linalg.eigvalsh(P)[0] > -1e-12 * np.trace(P)
        if frame % 5 == 0:
            kalman.commit(fused)
            since = nothing_yet(ERRORS)


def test_an_offset_that_is_measured_takes_back_what_it_did_to_the_pose() -> None:
    """Vision alone, all distances too long: once the offset is known, so is the way."""
    ahead, offset = np.array([0.25, 0.0, 0.0]), 0.3
    kalman = make(offset=0.3)
    for _ in range(40):
        kalman.commit(kalman.follow(vision(ahead, offset), 5))
    assert kalman.keyframe.pose[0] == pytest.approx(10.0 * (1 + 0.05 * offset), abs=1e-6)
    kalman.observe_offset(offset, 1e-4)
    assert kalman.offset()[0] == pytest.approx(offset, abs=1e-2)
    assert kalman.keyframe.pose[0] == pytest.approx(10.0, abs=0.01)


def test_an_offset_that_is_doubted_spreads_what_followed_from_it() -> None:
    """As if its sigma had been the wider one from the start."""
    ahead = np.array([0.25, 0.0, 0.01])
    narrow, wide = make(offset=0.1), make(offset=0.3)
    for kalman in (narrow, wide):
        for _ in range(20):
            kalman.commit(kalman.follow(vision(ahead), 1))
    narrow.doubt_offset(wide.offset()[1])
    np.testing.assert_allclose(narrow.keyframe.covariance, wide.keyframe.covariance, rtol=0.02)
    before = narrow.keyframe
    narrow.doubt_offset(0.01)
    assert narrow.keyframe is before, "what is doubted anyway is not made sure"


def test_doubt_covers_both_ends_from_keyframe_to_keyframe() -> None:
    """Tracks that move: whether the robot does or not, the truth is within two sigma."""
    kalman, moved = exact(), np.zeros(3)
    for _ in range(20):
        tracks = predicted(3)
        moved = compose(moved, tracks.pose)
        kalman.commit(kalman.doubt(tracks, np.zeros(3)))
    state = kalman.keyframe
    for truth in (np.zeros(3), moved):
        error = truth - state.pose
        assert error @ np.linalg.solve(state.covariance[:3, :3], error) < 4.0
    kalman.commit(kalman.fuse(predicted(3), vision(predicted(3).pose)))
    assert kalman.doubt(predicted(3), np.zeros(3)).doubt[0] < 0.2  # type: ignore[index]
