"""The paper's sets of experiments as courses in worlds like those that it names.

The paper tells frames, not ways; its camera gives some 30 a second, the simulated one 10. Speeds
are chosen so that courses fit into the worlds.
"""

from grouser.scripts.reproduction.zhao.course import Course
from grouser.scripts.reproduction.zhao.manoeuvres import SpotTurn, ThereAndBack, Tour
from grouser.scripts.reproduction.zhao.scale import Scale

LINEAR_SPEED = 0.15
"""m/s: 3 m out and back indoors, 9 m outdoors."""

SPOT_TURNS = (3, 4)
"""Turns of the two sets: 6 degrees a second."""

_LINEAR_OUTDOOR_WORLDS = ("parking-lot", "garden", "orchard", "parking-lot", "garden")
_FREE_OUTDOOR_WORLDS = ("parking-lot", "garden", "orchard")
_SEEDS_BETWEEN = 100


def linear_indoors(scale: Scale) -> tuple[Course, ...]:
    """200 frames out and 200 back, five times, in furnished rooms."""
    return tuple(
        Course(
            name=f"linear-indoors-{k + 1}",
            world="room",
            manoeuvre=ThereAndBack(LINEAR_SPEED),
            frames=scale.linear_indoor_frames,
            first_seed=k * _SEEDS_BETWEEN,
        )
        for k in range(scale.linear_sets)
    )


def linear_outdoors(scale: Scale) -> tuple[Course, ...]:
    """600 frames out and 600 back, five times: on asphalt, among hedges, in an orchard."""
    return tuple(
        Course(
            name=f"linear-outdoors-{k + 1}",
            world=world,
            manoeuvre=ThereAndBack(LINEAR_SPEED),
            frames=scale.linear_outdoor_frames,
            first_seed=k * _SEEDS_BETWEEN,
        )
        for k, world in enumerate(_LINEAR_OUTDOOR_WORLDS[: scale.linear_sets])
    )


def spot_turns(scale: Scale) -> tuple[Course, ...]:
    """On the asphalt of a parking lot and on the cement of a garden."""
    places = (("asphalt", "parking-lot"), ("cement", "garden"))
    return tuple(
        Course(
            name=f"spot-turn-{terrain}",
            world=world,
            terrain=terrain,
            manoeuvre=SpotTurn(turns),
            frames=frames,
        )
        for (terrain, world), turns, frames in zip(
            places, SPOT_TURNS, scale.spot_turn_frames, strict=True
        )
    )


def free_indoors(scale: Scale) -> tuple[Course, ...]:
    """Through the goals of furnished rooms."""
    return tuple(
        Course(
            name=f"free-indoors-{k + 1}",
            world="room",
            manoeuvre=Tour(),
            frames=scale.free_indoor_frames,
            first_seed=k * _SEEDS_BETWEEN,
        )
        for k in range(scale.free_indoor_sets)
    )


def free_outdoors(scale: Scale) -> tuple[Course, ...]:
    """Through the goals of a parking lot, a garden and an orchard."""
    return tuple(
        Course(name=f"free-outdoors-{k + 1}", world=world, manoeuvre=Tour(), frames=frames)
        for k, (world, frames) in enumerate(
            zip(_FREE_OUTDOOR_WORLDS, scale.free_outdoor_frames, strict=True)
        )
    )
