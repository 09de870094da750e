"""`grouser compare`: pose estimators side by side, in a simulated world or on a recording."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class Compare:
    """Compare pose estimators on the same observations: figures, trajectories and plots.

    In a world, the robot drives a scripted course that all estimators watch, so that they see the
    same bits; with --driver waypoints each drives on its own estimate. With --log, a recording is
    replayed.

    Some to try:

    grouser compare --seeds 2

    grouser compare --world yard --driver spot-turn --estimators dead-reckoning one-point-ransac

    grouser compare --driver waypoints --steps 400

    grouser compare --world room --estimators ekf-line-slam --steps 3400 --seeds 5

    grouser compare --world orchard --difficulty 0.8 --faults stereo.darkness:20:25:0.95

    grouser compare --log path/to/kitti/sequence --camera-z 1.65 --no-plots

    grouser compare --log path/to/intel.log --odometry-noise 0.02 --seeds 3 --reference-sigma .04 .4

    grouser compare --seeds 10 --output results/ten --resume
    """

    world: Annotated[str | None, option("NAME")] = None
    """Simulated world to drive in (yard when no --log is given); yan-normal and yan-over-range are
    the planes of paper 2, where a vehicle steers through their course."""
    log: Annotated[Path | None, option("PATH")] = None
    """Recording to replay instead: a KITTI-odometry-style folder of stereo images, a CARMEN log of
    a lidar and odometry (with NAME_ref.tum beside it, where there are reference poses), or a file
    of wheel ticks and scans."""
    odometry_noise: Annotated[float | None, option("SHARE")] = None
    """Recording: white noise on its odometry or tracks, one sigma as a share of the way and of the
    turn, such as 0.02; with it, each seed is another run."""
    reference_sigma: Annotated[tuple[float, float] | None, option("M DEG")] = None
    """Recording: how well its reference poses are known, one sigma of a coordinate and of the
    heading, such as 0.04 0.4; the NEES then allows for their noise."""
    estimators: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """Estimators to compare; by default ground-truth, dead-reckoning, one-point-ransac and
    five-point-ransac, as far as the source can feed them; without images ground-truth,
    dead-reckoning and ekf-line-slam."""
    seeds: Annotated[int, option("N")] = 1
    """Runs of each, one by default: seeds 0 to N-1, of the world and of random choices."""
    steps: Annotated[int | None, option("N")] = None
    """Steps a run: 600 (a minute) in a world, all of a recording or of a plane's course by
    default."""
    driver: Annotated[str | None, option("NAME")] = None
    """Course in a world: straight, spot-turn, figure-eight (default in the yard), tour (through
    the world's goals; default elsewhere), or waypoints (driven on the estimate)."""
    difficulty: Annotated[float | None, option("0..1")] = None
    """World: how hard; 0.5 by default."""
    terrain: Annotated[str | None, option("NAME")] = None
    """World: one ground everywhere (asphalt, cement, grass, gravel, ice, mud), or mixed."""
    randomize: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """World: what varies from seed to seed: texture, light, clutter, friction, sensor_noise."""
    dynamics: Annotated[str | None, option("NAME")] = None
    """World: bullet (default) or fast."""
    renderer: Annotated[str | None, option("NAME")] = None
    """World: raster (default) or opengl."""
    effects: Annotated[tuple[str, ...], option("NAME=AMOUNT ...")] = ()
    """World: what is wrong with sensors all the time, such as stereo.motion_blur=0.01."""
    faults: Annotated[tuple[str, ...], option("NAME:START:END:AMOUNT ...")] = ()
    """World: what goes wrong for a while [s], such as stereo.darkness:5:8:0.9."""
    output: Annotated[Path | None, option("DIR")] = None
    """Folder for the results; by default a new one, results/compare-..."""
    resume: bool = False
    """Complete the results in --output: runs that are there are not done again."""
    no_plots: bool = False
    """Do without the PNG plots of the top view and the error over distance."""
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
    disparity_offset_px: Annotated[float | None, option("PX")] = None
    """Recording: measured minus true disparity, where its rectification is not perfect."""

    def run(self) -> int:
        """Compare, print the table, and return the exit code."""
        from grouser.scripts.compare_work import compare  # help and misspellings need not wait

        return compare(self)
