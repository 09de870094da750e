"""A robot like Clearpath's Husky A200 in our simulator, driven as a recorded one was."""

from dataclasses import replace

import numpy as np

from grouser.envs.simulation.materials import MATERIALS
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.tracks import TrackModel
from grouser.geometry import Array
from grouser.scripts.plain_world import plain_world
from grouser.scripts.skid_steer_runs import DT, Run

GAUGE = 0.555
"""Between the middles of the left and right wheels, m (as the figures below from Clearpath's data
sheet and its robot description: 50 kg, 0.99 x 0.67 x 0.39 m, wheels of 0.165 m radius)."""
WHEELBASE = 0.512
"""Between the axles, m."""
SOILS = tuple(material.name for material in MATERIALS if material.name != "ice")

_WHEEL_RADIUS = 0.165
_WHEEL_CONTACT = 0.10
_BEYOND = (0.03, 0.06)

WHEELS = TrackModel(
    gauge=GAUGE,
    width=0.114,
    contact_length=_WHEEL_CONTACT,
    sinkage=0.005,
    n_patches=5,
    axles=(-WHEELBASE / 2, WHEELBASE / 2),
    approach=tuple(
        (beyond, ((_WHEEL_CONTACT / 2 + beyond) ** 2 - _WHEEL_CONTACT**2 / 4) / 2 / _WHEEL_RADIUS)
        for beyond in _BEYOND
    ),
)
"""Weight on four wheels, at the ends."""

TRACK = TrackModel(gauge=GAUGE, width=0.114, contact_length=WHEELBASE, sinkage=0.005)
"""The same weight evenly along two tracks, for comparison."""


def husky(tracks: TrackModel) -> RobotModel:
    """The robot on its wheels, or on tracks of the same length. Its inertia is that of its robot
    description, its centre of mass a little above the axles."""
    return RobotModel(
        mass=50.0,
        length=0.99,
        hull_width=0.67,
        hull_bottom=0.13,
        hull_top=0.37,
        com_height=0.18,
        inertia=(0.6, 1.7, 2.0),
        top_speed=1.0,
        motor_lag=0.02,  # the wheels' speeds are given as measured
        tracks=tracks,
    )


def drive_again(run: Run, tracks: TrackModel, soil: str) -> Array:
    """(n, 2) positions of the simulated robot whose wheels do what the recorded ones did, m."""
    robot = TrackedRobot(husky(tracks), dt=DT, dynamics="fast")
    motions = [robot.enter(plain_world(soil))]
    half_difference = run.yaw_rate * GAUGE / 2
    for wheels in np.column_stack([run.speed - half_difference, run.speed + half_difference])[:-1]:
        motions.append(robot.step(wheels))
    return np.array([motion.T_world_base[:2, 3] for motion in motions])


def with_lateral_factor(tracks: TrackModel, factor: float) -> TrackModel:
    """The same with another ratio of lateral to longitudinal force."""
    return replace(tracks, lateral_factor=factor)
