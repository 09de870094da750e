"""Figs. 4 and 5 on a simulated frame: what stereo makes of a pair, and the re-projection error."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from grouser.agents.scripted import figure_eight
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators.visual.frontend import FrontendOptions, StereoFrontend, grey
from grouser.geometry import Array, between, inverse_transform
from grouser.rig import StereoCamera
from grouser.scripts.reproduction.drawing import finish, new_figure
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Element, Paragraph, Picture, Section

NAME = "pictures"
SIZE = (400, 300)
"""Of the paper's fig. 4, px."""

_SEED, _STEPS, _APART = 0, 12, 4
_BLOCK = 5  # px, of the dense matcher
_DISPARITIES = 64
_NEAR_PX = 2.0
_DEPTHS = (1.0, 5.0)  # m, of the point that is drawn


@dataclass(frozen=True, slots=True)
class PicturesExperiment(Experiment):
    """Two stereo pairs some steps apart, with the truth of where things are."""

    @property
    def name(self) -> str:
        return NAME

    @property
    def parts(self) -> int:
        return _STEPS

    def run(self, on_part: OnPart) -> Outcome:
        """`left`, `right` (H, W, 3) and `depth` (H, W) of the later pair, and one point of both
        pairs: `point`, `point_now` (3,) u, v, d [px], with the camera's way between them."""
        env = TrackedRobotEnv(sensors=("left", "right"), image_size=SIZE, color=True)
        observation, info = env.reset(seed=_SEED)
        drive, pairs = figure_eight(env.rig), []
        for step in range(_STEPS):
            pairs.append((observation, info["true_pose_3d"]))
            observation, *_, info = env.step(drive(step).astype(np.float32))
            on_part()
        pairs.append((observation, info["true_pose_3d"]))
        depth = env.depth()
        camera = env.rig.stereo
        assert camera is not None
        env.close()
        (before, T_before), (now, T_now) = pairs[-1 - _APART], pairs[-1]
        mount = camera.T_base_camera
        T_now_before = inverse_transform(T_now @ mount) @ T_before @ mount
        point, point_now = _followed(before, now, T_now_before, camera)
        return {
            "left": now["left"],
            "right": now["right"],
            "depth": depth,
            "point": point,
            "point_now": point_now,
            "T_now_before": T_now_before,
            "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy, camera.baseline]),
            "pose_before": _on_plane(T_before @ mount),
            "pose_now": _on_plane(T_now @ mount),
        }


def _features(observation: Any) -> Array:
    """(n, 3) u, v, d [px], calibrated and sub-pixel in d."""
    frontend = StereoFrontend(FrontendOptions())
    left, right = (grey(observation[eye], eye) for eye in ("left", "right"))
    return frontend.make_keyframe(frontend.extract(left, right)).points


def _followed(
    before: Any, now: Any, T_now_before: Array, camera: StereoCamera
) -> tuple[Array, Array]:
    """One point that is found in both pairs, far from horizon and epipole."""
    w, found = _features(before), _features(now)
    z = camera.fx * camera.baseline / w[:, 2]
    w = w[(z > _DEPTHS[0]) & (z < _DEPTHS[1])]
    expected = _forecast(w, T_now_before, camera)
    away = np.linalg.norm(found[None] - expected[:, None], axis=2)
    partner = away.argmin(axis=1)
    good = np.flatnonzero(away.min(axis=1) < _NEAR_PX)
    # Neither near the horizon nor near the epipole, where (20) has its poles.
    centre_now = -T_now_before[:3, :3].T @ T_now_before[:3, 3]
    epipole = camera.fx * centre_now[0] / centre_now[2] + camera.cx
    horizon = camera.cy - camera.fy * np.tan(_PITCH)
    aside = np.abs(w[good, :2] - [epipole, horizon]).min(axis=1)
    chosen = good[aside.argmax()]
    return w[chosen], found[partner[chosen]]


def _forecast(w: Array, T_now_before: Array, camera: StereoCamera) -> Array:
    z = camera.fx * camera.baseline / w[:, 2]
    rays = np.column_stack([(w[:, 0] - camera.cx) / camera.fx, (w[:, 1] - camera.cy) / camera.fy])
    P = np.column_stack([rays * z[:, None], z]) @ T_now_before[:3, :3].T + T_now_before[:3, 3]
    u, v = camera.fx * P[:, 0] / P[:, 2] + camera.cx, camera.fy * P[:, 1] / P[:, 2] + camera.cy
    return np.column_stack([u, v, camera.fx * camera.baseline / P[:, 2]])


def _on_plane(T_world_camera: Array) -> Array:
    """(3,) place and direction of view, seen from above."""
    forward = T_world_camera[:3, 2]
    return np.array([*T_world_camera[:2, 3], np.arctan2(forward[1], forward[0])])


@dataclass(frozen=True, slots=True)
class Reprojection:
    """The quantities of fig. 5, for one point seen from two places; angles in the plane."""

    chord: float
    """Way of the camera, m."""
    range_before: float
    """Horizontal, m."""
    range_now: float
    gamma: float
    """Between the ray and the chord, rad, before."""
    gamma_now: float
    alpha: float
    """Elevation of the ray, down positive, rad, before."""
    alpha_now: float


def reprojection(outcome: Outcome) -> Reprojection:
    """Measured on the images: ranges and elevations by stereo, angles from the camera's true way.

    The identities (18) hold for the way of the camera, wherever on the robot it is.
    """
    before, now = (_levelled(outcome, w) for w in ("point", "point_now"))
    way = between(outcome["pose_before"], outcome["pose_now"])
    direction = float(np.arctan2(way[1], way[0]))
    bearing, bearing_now = np.arctan2(before[1], before[0]), np.arctan2(now[1], now[0])
    D, D_ = np.hypot(*before[:2]), np.hypot(*now[:2])
    return Reprojection(
        chord=float(np.hypot(way[0], way[1])),
        range_before=float(D),
        range_now=float(D_),
        gamma=direction - float(bearing),
        gamma_now=direction - float(way[2] + bearing_now),
        alpha=float(np.arctan2(-before[2], D)),
        alpha_now=float(np.arctan2(-now[2], D_)),
    )


def _levelled(outcome: Outcome, name: str) -> Array:
    """(3,) the point forward, left and up of the camera, m, its pitch taken out."""
    fx, fy, cx, cy, baseline = outcome["intrinsics"]
    u, v, d = outcome[name]
    z = fx * baseline / d
    x, y = (u - cx) / fx * z, (v - cy) / fy * z
    c, s = np.cos(_PITCH), np.sin(_PITCH)
    return np.array([c * z - s * y, -x, -s * z - c * y])


_PITCH = np.radians(10)  # of the simulated camera


def picture_figures(outcome: Outcome) -> Figures:
    """How good the dense disparities are, and the sides of (18) and (20)."""
    view = reprojection(outcome)
    fx, _, _, _, baseline = outcome["intrinsics"]
    measured, true = _dense(outcome), fx * baseline / outcome["depth"]
    known = measured > 0
    error = np.abs(measured - true)[known]
    sine, sine_now = np.sin(view.gamma), np.sin(view.gamma_now)
    tangent, tangent_now = np.tan(view.alpha), np.tan(view.alpha_now)
    values = {
        "disparity_known_percent": 100 * float(known.mean()),
        "disparity_error_px": float(np.median(error)),
        "chord_m": view.chord,
        "range_before_m": view.range_before,
        "range_now_m": view.range_now,
        "gamma_deg": float(np.degrees(view.gamma)),
        "gamma_now_deg": float(np.degrees(view.gamma_now)),
        "across_before_m": float(view.range_before * sine),
        "across_now_m": float(view.range_now * sine_now),
        "drop_before_m": float(view.range_before * tangent),
        "drop_now_m": float(view.range_now * tangent_now),
        "error_theta": abs(float(tangent_now / tangent - sine_now / sine)),
    }
    return named("pictures", values)


def picture_elements(outcome: Outcome) -> list[Element]:
    """Figs. 4 and 5."""
    return [
        Picture(
            "Fig. 4: (a) the rectified pair; (b) edges; (c) disparity by semi-global matching, "
            "known for {pictures.disparity_known_percent:.0f} % of the pixels, with a median error "
            "of {pictures.disparity_error_px:.2f} px against the simulator's depth.",
            _stereo(outcome),
        ),
        Picture("Fig. 5: the geometry of the re-projection error, from above.", _plan(outcome)),
        Paragraph(
            "The point is {pictures.range_before_m:.3f} m away before and "
            "{pictures.range_now_m:.3f} m after a way of {pictures.chord_m:.3f} m, "
            "{pictures.gamma_deg:.2f} and {pictures.gamma_now_deg:.2f} degrees beside it. Both "
            "sides of (18), measured on the images: {pictures.across_before_m:.3f} and "
            "{pictures.across_now_m:.3f} m across the way, {pictures.drop_before_m:.3f} and "
            "{pictures.drop_now_m:.3f} m below the camera; the error of (20) is "
            "{pictures.error_theta:.4f}."
        ),
    ]


def pictures_section(outcome: Outcome) -> Section:
    """Figs. 4 and 5."""
    return Section("A simulated frame", picture_elements(outcome))


def _dense(outcome: Outcome) -> Array:
    """(H, W) disparity by semi-global matching, px; negative where there is none."""
    left, right = (grey(outcome[eye], eye) for eye in ("left", "right"))
    matcher = cv2.StereoSGBM.create(
        numDisparities=_DISPARITIES,
        blockSize=_BLOCK,
        P1=8 * _BLOCK**2,
        P2=32 * _BLOCK**2,
        uniquenessRatio=10,
        speckleWindowSize=80,
        speckleRange=2,
        disp12MaxDiff=1,
    )
    return np.asarray(matcher.compute(left, right) / 16.0)


def _stereo(outcome: Outcome) -> Any:
    figure, axes = new_figure(11, 2.5, 1, 4)
    left, right = outcome["left"], outcome["right"]
    edges = cv2.Canny(grey(left, "left"), 60, 150)
    disparity = np.ma.masked_less_equal(_dense(outcome), 0)
    pictures = ((left, None), (right, None), (255 - edges, "gray"), (disparity, "viridis"))
    titles = ("(a) left", "(a) right", "(b) edges", "(c) disparity [px]")
    for area, (picture, colors), title in zip(axes[0], pictures, titles, strict=True):
        drawn = area.imshow(picture, cmap=colors)
        area.set_title(title, fontsize="medium")
        area.set_axis_off()
    figure.colorbar(drawn, ax=axes[0, 3], shrink=0.8)
    return figure


def _plan(outcome: Outcome) -> Any:
    """Seen from above, the way of the camera to the right."""
    figure, axes = new_figure(7.5, 3.6)
    area, view = axes[0, 0], reprojection(outcome)
    there = view.range_before * np.array([np.cos(view.gamma), np.sin(view.gamma)])
    cameras = (
        (0.0, "", view.range_before, view.gamma, 0.42),
        (view.chord, "'", view.range_now, view.gamma_now, 0.62),
    )
    for x, prime, size, angle, share in cameras:
        (ray,) = area.plot([x, there[0]], [0, there[1]], "-", lw=1.5)
        middle = [x + share * (there[0] - x), share * there[1]]
        label = {"color": ray.get_color(), "fontsize": 10, "ha": "center", "va": "center"}
        label["bbox"] = {"fc": "white", "ec": "none", "pad": 1}
        area.text(*middle, f"$D_h{prime}$ = {size:.2f} m", **label)
        arc = np.linspace(0, angle, 30)
        radius = 0.13 * size
        area.plot(x + radius * np.cos(arc), radius * np.sin(arc), color=ray.get_color(), lw=1)
        at = (x + 1.35 * radius * np.cos(angle / 2), 1.35 * radius * np.sin(angle / 2))
        area.text(*at, f"$\\gamma{prime}$", color=ray.get_color(), ha="center", va="center")
        area.plot(x, 0, "ko")
        area.annotate(f"camera{prime}", (x, 0), (0, -16), textcoords="offset points", ha="center")
    area.plot([-0.1 * view.range_before, 1.25 * there[0]], [0, 0], "k--", lw=0.8)
    area.plot([there[0], there[0]], [0, there[1]], "k:", lw=1)
    area.text(
        there[0] * 1.02, there[1] / 2, "$D_h\\,\\sin\\gamma = D_h'\\,\\sin\\gamma'$", va="center"
    )
    area.plot(*there, "r*", ms=12)
    area.set_aspect("equal")
    area.margins(y=0.18)
    finish(area, x="along the way of the camera [m]", y="beside it [m]")
    return figure
