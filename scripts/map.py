"""`grouser map`: a map of lines that people can look at, and estimators find their way by."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class Map:
    """Map lines on a drive through a world, or on a recording; or find the way by such a map.

    It writes map.geojson, which opens in any viewer of GeoJSON (its coordinates are metres in the
    frame of the start), map.png, the lines with the bands in which they lie over what is truly
    there, and the estimated and the true poses as poses.tum and truth.tum, which evo reads.

    With --map, the lines of a file are taken for granted and nothing is added to them: the start
    must be where the map's drive started.

    Some to try:

    grouser map

    grouser map --world yan-over-range --seed 3 --output over

    grouser map --world yan-over-range --map over/map.geojson --seed 4 --output again

    grouser map --world corridor --steps 1500

    grouser map --log path/to/intel.log
    """

    world: Annotated[str | None, option("NAME")] = None
    """World to drive in: yan-normal (the default) or yan-over-range, the planes of paper 2, or one
    of those that `grouser worlds` draws."""
    log: Annotated[Path | None, option("FILE")] = None
    """Recording with a lidar to replay instead, as grouser/Replay-v0 takes it."""
    odometry_noise: Annotated[float | None, option("SHARE")] = None
    """Recording: white noise on its odometry or tracks, as of grouser compare."""
    estimator: Annotated[str, option("NAME")] = "ekf-line-slam"
    """Who maps: ekf-line-slam by default."""
    options: Annotated[tuple[str, ...], option("NAME=VALUE ...")] = ()
    """Options of the estimator, such as paper=true."""
    map: Annotated[Path | None, option("FILE")] = None
    """Map to find the way by, of an earlier run: map.geojson."""
    lidar: bool = False
    """Paper 2's planes: look with a lidar instead of a sensor that tells the ends of lines."""
    seed: Annotated[int, option("N")] = 0
    """Of the world, the noise and random choices; 0 by default."""
    steps: Annotated[int | None, option("N")] = None
    """Steps at most: one loop on a plane, 600 in a world, all of a recording by default."""
    sigmas: Annotated[float, option("K")] = 3.0
    """Half width of the bands in the picture, in standard deviations; 3 by default."""
    output: Annotated[Path | None, option("DIR")] = None
    """Folder for the results; by default a new one, results/map-..."""

    def run(self) -> int:
        """Drive, write the map, say how good it is, and return the exit code."""
        from grouser.scripts.map_work import make_map  # help and misspellings need not wait

        return make_map(self)
