"""The disparity offset of a stereo pair, from a drive: by structure, odometry and known distance.

A disparity that is off by o makes a distance z off by z^2 o / (f B), and every way that vision
measures with it. Odometry, or a distance that was taped, tells by how much; the points alone tell
too (`structure`). All three are linear in o near the truth, so that a drive is looked at again with
what was found, until nothing changes.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.visual.engine import KeyframeOdometry, Leg
from grouser.estimators.visual.frontend import FrontendOptions
from grouser.estimators.visual.fusion import RelativeFilter
from grouser.estimators.visual.image_frontend import ImageFrontend
from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.matching import MatchingOptions, PixelNoise
from grouser.estimators.visual.offset_watch import OffsetEstimate, together
from grouser.estimators.visual.one_point import OnePointRansac
from grouser.estimators.visual.prediction import MotionPredictor, VelocityPredictor
from grouser.estimators.visual.prior import ChassisPrior
from grouser.estimators.visual.sight import KeyframeSight
from grouser.geometry import Array, between, compose, compose_jacobians
from grouser.rig import Rig

SETTLED = 0.005
"""px by which the last look at a drive changes the offset."""


@dataclass(frozen=True, slots=True)
class Odometry:
    """What else is known of the way."""

    stamps: Array
    """(n,) s"""
    poses: Array
    """(n, 3) in any frame that stays"""
    scale_sigma: float
    """By what share all its distances may be wrong together."""


@dataclass(frozen=True, slots=True)
class Distance:
    """How far the end of the drive is from its start, as the crow flies."""

    metres: float
    sigma: float
    """m"""


def look(rig: Rig, observations: Iterable[Observation]) -> list[Leg]:
    """The legs that vision alone measures, with the rig's disparity offset taken out.

    Raises:
        ValueError: the rig has no stereo camera.
    """
    if rig.stereo is None:
        raise ValueError("a disparity offset is one of rig.stereo, and this rig has None")
    camera, legs = rig.stereo, list[Leg]()
    frontend = ImageFrontend(
        camera, options=FrontendOptions(), matching=MatchingOptions(), noise=PixelNoise()
    )

    def velocity(observation: Observation) -> MotionPredictor:
        return VelocityPredictor(_FASTEST * rig.dt)

    engine = KeyframeOdometry(
        frontend,
        KeyframeSight(camera, frontend, OnePointRansac(camera)),
        make_predictor=velocity,
        make_filter=lambda errors: RelativeFilter(errors, disparity_sigma=_ANYTHING),
        prior=ChassisPrior(),
        mount_sigma=camera.mount_sigma,
        rule=KeyframeRule(),
        lost_after=np.inf,
        on_keyframe=legs.append,
    )
    shown = iter(observations)
    first = next(shown)
    engine.reset(first, rng=np.random.default_rng(0))
    for observation in shown:
        engine.update(observation)
    return [Leg(float(first["stamp"][0]), None, None), *legs]


def by_structure(legs: Sequence[Leg]) -> OffsetEstimate | None:
    """From the points alone; None where they tell too little."""
    return together([leg.evidence for leg in legs if leg.evidence is not None])


def by_odometry(legs: Sequence[Leg], odometry: Odometry) -> OffsetEstimate | None:
    """From how much longer or shorter vision finds the legs; None where they are too short."""
    seen, known, by_offset, variance = 0.0, 0.0, 0.0, 0.0
    for before, leg in zip(legs, legs[1:], strict=False):
        if leg.seen is None:
            continue
        way = _between(odometry, before.stamp, leg.stamp)
        length = np.hypot(*way[:2])
        if length < _SHORT:
            continue
        ahead = way[:2] / length
        seen += float(ahead @ leg.seen.pose[:2])
        known += float(length)
        by_offset += float(ahead @ leg.seen.by_disparity[:2])
        variance += float(ahead @ leg.seen.covariance[:2, :2] @ ahead)
    sigma = np.hypot(np.sqrt(variance), odometry.scale_sigma * known)
    return _solved(seen - known, by_offset, float(sigma))


def by_distance(legs: Sequence[Leg], distance: Distance) -> OffsetEstimate | None:
    """From where vision ends up; None where it hangs too little on the offset.

    Raises:
        ValueError: vision failed somewhere on the way.
    """
    pose, covariance, by_offset = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    for leg in legs[1:]:
        if leg.seen is None:
            raise ValueError(
                f"vision failed before {leg.stamp:.1f} s: a known distance needs a drive that is "
                "seen from its start to its end; leave it out, or take another drive"
            )
        F, V = compose_jacobians(pose, leg.seen.pose)
        covariance = F @ covariance @ F.T + V @ leg.seen.covariance @ V.T
        by_offset = F @ by_offset + V @ leg.seen.by_disparity
        pose = compose(pose, leg.seen.pose)
    length = float(np.hypot(*pose[:2]))
    if length == 0:
        return None
    away = pose[:2] / length
    sigma = np.hypot(np.sqrt(away @ covariance[:2, :2] @ away), distance.sigma)
    return _solved(length - distance.metres, float(away @ by_offset[:2]), float(sigma))


def combined(estimates: Iterable[OffsetEstimate | None]) -> OffsetEstimate:
    """The mean of those that there are, by how sure they are.

    Raises:
        ValueError: there is none.
    """
    there = [estimate for estimate in estimates if estimate is not None]
    if not there:
        raise ValueError(
            "nothing on this drive tells of the disparity offset: it takes a few metres of driving "
            "straight or in wide curves, in light, past things at different distances"
        )
    weights = np.array([estimate.sigma**-2.0 for estimate in there])
    mean = weights @ [estimate.offset for estimate in there] / weights.sum()
    return OffsetEstimate(float(mean), float(weights.sum() ** -0.5))


def _solved(excess: float, by_offset: float, sigma: float) -> OffsetEstimate | None:
    """The offset that explains an excess of a length [m] that it changes by so much a pixel."""
    if abs(by_offset) * _USELESS < sigma or by_offset == 0:
        return None
    return OffsetEstimate(excess / by_offset, sigma / abs(by_offset))


def _between(odometry: Odometry, start: float, end: float) -> Array:
    """(3,) pose at one stamp as seen from another."""
    a, b = (int(np.argmin(np.abs(odometry.stamps - stamp))) for stamp in (start, end))
    return np.asarray(between(odometry.poses[a], odometry.poses[b]))


_FASTEST = np.array([15.0, 1.0, 1.0])  # m/s, m/s, rad/s: one sigma of an unknown velocity
_ANYTHING = 1.0  # px: the offset is what is sought
_SHORT = 0.05  # m: shorter legs are turns on the spot, or rest
_USELESS = 5.0  # px of sigma
