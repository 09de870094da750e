"""The synthetic world is what SPEC 1.7 says it is."""

from dataclasses import replace

import numpy as np
import pytest

from grouser.estimators.track_motion import arc_pose, track_increment
from grouser.geometry import Array, compose, inverse_transform, lift
from grouser.scripts.montecarlo_scenarios import SCENARIOS, STEP
from grouser.scripts.montecarlo_world import TRACKS, Run, WorldOptions, drive

EXACT = WorldOptions(noise_px=0.0, outliers=0.0, scale_sigma=0.0, width_sigma=0.0, white_noise=0.0)


def run(scenario: str, options: WorldOptions, seed: int = 0) -> Run:
    chosen = SCENARIOS[scenario]
    return drive(chosen.motion(), chosen.camera, options, np.random.default_rng(seed))


def world_points(run: Run, k: int) -> dict[int, Array]:
    """By identity: where the points of frame k are, from what is seen and the truth."""
    seen, camera = run.observations[k], run.rig.stereo
    assert camera is not None
    u, v, d = seen["points"].T
    z = camera.fx * camera.baseline / d
    there = np.column_stack([(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z])
    T = lift(run.truth[k]) @ camera.T_base_camera
    found = there @ T[:3, :3].T + T[:3, 3]
    return dict(zip(seen["identities"].tolist(), found, strict=True))


@pytest.mark.parametrize("scenario", ["free", "spot-offset", "sideslip"])
def test_points_keep_identity_and_place_while_they_are_visible(scenario: str) -> None:
    made = run(scenario, EXACT)
    for k in (0, 40, 200):
        before, now = world_points(made, k), world_points(made, k + 8)
        common = before.keys() & now.keys()
        assert len(common) > 80
        for identity in common:
            np.testing.assert_allclose(before[identity], now[identity], atol=1e-9)
    first, last = (set(made.observations[k]["identities"]) for k in (0, 250))
    assert len(last - first) > 20, "others have come into view"


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_everything_is_in_view_and_in_range(scenario: str) -> None:
    made = run(scenario, EXACT)
    T = inverse_transform(SCENARIOS[scenario].camera.T_base_camera)
    assert made.rig.stereo is not None
    np.testing.assert_allclose((T @ made.rig.stereo.T_base_camera)[:3, 3], [0.06, 0, 0], atol=1e-12)
    for seen in made.observations[::37]:
        u, v, d = seen["points"].T
        assert ((u - d / 2 >= 0) & (u + d / 2 <= 320) & (v >= 0) & (v <= 240)).all()
        z = 260 * 0.12 / d
        assert ((z > 0.8) & (z < 9)).all()


def test_tracks_without_errors_drive_the_truth() -> None:
    for scenario in ("linear", "spot", "free"):
        made, pose = run(scenario, EXACT), np.zeros(3)
        for seen in made.observations[1:]:
            step = arc_pose(*track_increment(seen["tracks"], TRACKS.effective_width))
            pose = compose(pose, step)
        np.testing.assert_allclose(pose, made.truth[-1], atol=1e-9)


def test_slip_and_dark_are_what_they_are_called() -> None:
    slipping, sliding = run("slip", EXACT), run("sideslip", EXACT)
    np.testing.assert_allclose(slipping.observations[1]["tracks"], STEP / 0.9)
    np.testing.assert_allclose(sliding.truth[200], [200 * STEP, 0.05 * 200 * STEP, 0], atol=1e-9)
    blind = [
        k for k, seen in enumerate(run("blackout", EXACT).observations) if not len(seen["points"])
    ]
    assert blind == list(range(101, 161))
    turned = run("spot-slip", EXACT).observations[1]["tracks"]
    assert (turned[1] - turned[0]) / TRACKS.effective_width == pytest.approx(np.radians(1) / 0.85)


def test_the_share_of_wrong_matches_and_the_errors_of_the_tracks_are_as_asked() -> None:
    wrong, along = [], []
    for seed in range(24):
        made = run("linear", replace(WorldOptions(), outliers=0.4), seed)
        for seen in made.observations[:40]:
            off = seen["mismatched"] - seen["points"]
            wrong.append((off != 0).any(axis=1).mean())
            assert np.abs(off).max() <= 20 and (seen["mismatched"][:, 2] > 0).all()
        tracks = np.array([seen["tracks"] for seen in made.observations[1:201]])
        along.append(tracks / STEP - 1)
    assert np.mean(wrong) == pytest.approx(0.4, abs=0.01)
    scale = np.mean(along, axis=1)  # 48 draws of a sigma
    assert np.std(scale) == pytest.approx(0.01, rel=0.3)
    assert np.std(along - scale[:, None]) == pytest.approx(0.02, rel=0.03)


def test_the_seed_decides_everything() -> None:
    one, same, other = (run("free", WorldOptions(), seed) for seed in (1, 1, 2))
    for a, b in zip(one.observations, same.observations, strict=True):
        for key in a:
            np.testing.assert_array_equal(a[key], b[key])
    assert not np.array_equal(one.observations[9]["tracks"], other.observations[9]["tracks"])
