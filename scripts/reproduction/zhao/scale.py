"""How much of everything is done: as much as the paper did, or a little, to see that it works."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scale:
    """Numbers of frames, sets and trials."""

    timing_frames: int = 300
    stability_frames: int = 10_000
    linear_sets: int = 5
    linear_indoor_frames: int = 400
    """Out and back together."""
    linear_outdoor_frames: int = 1200
    spot_turn_frames: tuple[int, int] = (1800, 2400)
    """On asphalt and on cement; three and four turns."""
    free_indoor_sets: int = 3
    """The paper does not say how many; nor how long they were."""
    free_indoor_frames: int = 600
    free_outdoor_frames: tuple[int, int, int] = (1403, 2419, 2670)
    offset_frames: int = 600
    """One turn."""
    slip_frames: int = 400
    trials: int = 400
    """Of the solvers, at each outlier ratio and each side slip."""
    errata_runs: int = 200


FULL = Scale()
QUICK = Scale(
    timing_frames=12,
    stability_frames=40,
    linear_sets=1,
    linear_indoor_frames=16,
    linear_outdoor_frames=16,
    spot_turn_frames=(12, 12),
    free_indoor_sets=1,
    free_indoor_frames=16,
    free_outdoor_frames=(14, 14, 14),
    offset_frames=12,
    slip_frames=12,
    trials=10,
    errata_runs=20,
)
