"""`grouser calibrate`: what a drive tells of a calibration."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from grouser.scripts.option import option


@dataclass(frozen=True)
class Calibrate:
    """Find the disparity offset of a stereo pair from a drive: measured minus true disparity.

    Rectification leaves a constant error of the disparities; a tenth of a pixel makes all distances
    wrong by a share that grows with them. Three things tell of it: the points themselves, which
    only without an offset move as a rigid world does; odometry; and a known distance.

    Some to try:

    grouser calibrate disparity --log path/to/kitti/sequence

    grouser calibrate disparity --log path/to/sequence --distance 12.50

    grouser calibrate disparity --world yard --offset-px 0.5
    """

    what: Annotated[tyro.conf.Positional[Literal["disparity"]], option("disparity")]
    """What is calibrated."""
    log: Annotated[Path | None, option("DIR")] = None
    """Recording of the drive: a KITTI-odometry-style folder of stereo images."""
    world: Annotated[str | None, option("NAME")] = None
    """Simulated world to drive in instead, to see how well it works."""
    offset_px: Annotated[float | None, option("PX")] = None
    """World: the offset that the simulated pair has; 0 by default."""
    driver: Annotated[str | None, option("NAME")] = None
    """World: straight, spot-turn or figure-eight (default)."""
    seed: Annotated[int | None, option("N")] = None
    """World: its seed; 0 by default."""
    steps: Annotated[int | None, option("N")] = None
    """Steps of the drive: 300 (half a minute) in a world, all of a recording by default."""
    odometry: Annotated[str | None, option("NAME")] = None
    """What else to trust: tracks, reference (the recording's reference poses, or the simulator's
    truth) or none. By default tracks in a world, and in a recording the reference if it has one."""
    odometry_sigma: Annotated[float | None, option("SHARE")] = None
    """How wrong all its distances may be together: 0.02 for tracks, 0.003 for a reference."""
    distance: Annotated[float | None, option("M")] = None
    """Known distance from where the drive starts to where it ends, as the crow flies."""
    distance_sigma: Annotated[float | None, option("M")] = None
    """How well that is known; 0.01 m by default."""
    output: Annotated[Path | None, option("FILE")] = None
    """JSON file for the figures."""
    camera_x: Annotated[float | None, option("M")] = None
    """Recording: how far the left camera is ahead of the robot's centre."""
    camera_y: Annotated[float | None, option("M")] = None
    """Recording: how far it is to the left of it."""
    camera_z: Annotated[float | None, option("M")] = None
    """Recording: how far it is above it."""
    camera_roll_degrees: Annotated[float | None, option("DEG")] = None
    """Recording: its roll, the right side down."""
    camera_pitch_degrees: Annotated[float | None, option("DEG")] = None
    """Recording: its pitch, looking down."""
    camera_yaw_degrees: Annotated[float | None, option("DEG")] = None
    """Recording: its yaw, looking to the left."""

    def run(self) -> int:
        """Calibrate, print the figures, and return the exit code."""
        from grouser.scripts.calibrate_work import calibrate  # help need not wait

        return calibrate(self)
