"""What `grouser calibrate disparity` does: drive or replay, look again and again, report."""

import json
from dataclasses import asdict, dataclass, replace

from rich.table import Table

from grouser.estimators.visual.offset_calibration import (
    SETTLED,
    Distance,
    by_distance,
    by_odometry,
    by_structure,
    combined,
    look,
)
from grouser.estimators.visual.offset_watch import SUSPECT, OffsetEstimate
from grouser.rig import Rig
from grouser.scripts.calibrate import Calibrate
from grouser.scripts.calibrate_drive import Drive, record
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors

_LOOKS = 6
_DISTANCE_SIGMA = 0.01  # m


@dataclass(frozen=True, slots=True)
class Calibration:
    """The offset by each kind of evidence, and by all of it."""

    structure: OffsetEstimate | None
    odometry: OffsetEstimate | None
    distance: OffsetEstimate | None
    offset: OffsetEstimate


def calibrate(options: Calibrate) -> int:
    """Calibrate, print the figures, and return the exit code."""
    with usage_errors():
        distance = _distance(options)
        if options.output is not None and not options.output.parent.is_dir():
            raise UsageError(f"--output {options.output}: there is no folder for it")
        drive = record(options)
        found = find(drive, distance)
    console = table_console()
    console.print(_table(found, drive))
    for line in _advice(found, drive):
        console.print(line, soft_wrap=True)
    if options.output is not None:
        options.output.write_text(json.dumps(asdict(found), indent=2) + "\n")
        console.print(f"figures: {options.output}")
    return 0


def find(drive: Drive, distance: Distance | None) -> Calibration:
    """Look at the drive with ever better offsets until nothing changes.

    Raises:
        ValueError: nothing on the drive tells of the offset.
    """
    assert drive.rig.stereo is not None
    taken_out = drive.rig.stereo.disparity_offset
    with progress("looking", _LOOKS * len(drive.observations)) as bar:
        for _ in range(_LOOKS):
            legs = look(_with_offset(drive.rig, taken_out), bar.over(drive.observations))
            left = [
                by_structure(legs),
                None if drive.odometry is None else by_odometry(legs, drive.odometry),
                None if distance is None else by_distance(legs, distance),
            ]
            rest = combined(left)
            if abs(rest.offset) < SETTLED:
                break
            taken_out += rest.offset
        else:
            taken_out -= rest.offset
    structure, odometry, known = (_shifted(estimate, taken_out) for estimate in left)
    offset = replace(rest, offset=rest.offset + taken_out)
    return Calibration(structure, odometry, known, offset)


def _with_offset(rig: Rig, offset: float) -> Rig:
    return rig.with_overrides({"stereo.disparity_offset": offset})


def _shifted(estimate: OffsetEstimate | None, by: float) -> OffsetEstimate | None:
    return None if estimate is None else replace(estimate, offset=estimate.offset + by)


def _distance(options: Calibrate) -> Distance | None:
    if options.distance is None:
        if options.distance_sigma is not None:
            raise UsageError("--distance-sigma has no effect without --distance")
        return None
    sigma = _DISTANCE_SIGMA if options.distance_sigma is None else options.distance_sigma
    if not (options.distance > 0 and sigma > 0):
        raise UsageError(
            f"--distance and --distance-sigma must be positive, got {options.distance} and {sigma}"
        )
    return Distance(options.distance, sigma)


def _table(found: Calibration, drive: Drive) -> Table:
    table = Table(title=f"Disparity offset (measured minus true), {drive.label}")
    table.add_column("by")
    table.add_column("offset, px", justify="right")
    table.add_column("sigma, px", justify="right")
    rows = {
        "the points alone": found.structure,
        drive.odometry_label: found.odometry,
        "the known distance": found.distance,
        "all of it": found.offset,
    }
    for name, estimate in rows.items():
        if estimate is not None:
            table.add_row(name, f"{estimate.offset:+.3f}", f"{estimate.sigma:.3f}")
    return table


def _advice(found: Calibration, drive: Drive) -> list[str]:
    """What to do with it, and what to beware of."""
    offset = found.offset
    lines = [
        f"use it: --disparity-offset-px {offset.offset:.3f} with grouser compare --log, or in the "
        f"rig's YAML stereo: {{disparity_offset: {offset.offset:.3f}, disparity_sigma: "
        f"{offset.sigma:.3f}}}"
    ]
    assert drive.rig.stereo is not None
    if abs(offset.offset - drive.rig.stereo.disparity_offset) <= SUSPECT * offset.sigma:
        said = drive.rig.stereo.disparity_offset
        lines.append(f"the rig says {said:g} px, which this drive does not contradict")
    for name, other in ((drive.odometry_label, found.odometry), ("distance", found.distance)):
        if found.structure is None or other is None:
            continue
        apart = abs(found.structure.offset - other.offset)
        if apart > 3 * (found.structure.sigma**2 + other.sigma**2) ** 0.5:
            lines.append(
                f"beware: the points and the {name} are {apart:.2f} px apart, more than both can "
                "be wrong; its scale, the focal length or the baseline is not what it is said to be"
            )
    return lines
