"""Which kind of recording a path is: by what is found there, not by its name."""

from pathlib import Path

from grouser.envs.recordings.carmen import open_carmen
from grouser.envs.recordings.recording import Recording
from grouser.envs.recordings.stereo import StereoRecording
from grouser.envs.recordings.ticks import open_ticks
from grouser.text_table import read_text


def open_recording(path: str | Path) -> Recording:
    """Open a folder of stereo images, a CARMEN log, or a file of wheel ticks and scans.

    Raises:
        FileNotFoundError: there is nothing, or a part of it is missing.
        ValueError: it is malformed; the message names file and line.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(
            f"{path} is missing or is not a folder of stereo images, a CARMEN log or a file of "
            "wheel ticks and scans"
        )
    if path.is_dir():
        return StereoRecording(path)
    return open_ticks(path) if _begins_with_number(path) else open_carmen(path)


def _begins_with_number(path: Path) -> bool:
    """Messages of CARMEN begin with a name."""
    words = (line.split()[0] for line in read_text(path).splitlines() if line.strip())
    first = next((word for word in words if not word.startswith("#")), "")
    return first[:1].isdigit()
