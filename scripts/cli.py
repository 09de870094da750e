"""The command `grouser`: one subcommand a program."""

import logging
import sys
from collections.abc import Callable, Sequence
from typing import Protocol

import tyro

from grouser import __version__
from grouser.scripts.abuse import Abuse
from grouser.scripts.calibrate import Calibrate
from grouser.scripts.compare import Compare
from grouser.scripts.evaluate import Evaluate
from grouser.scripts.fit_emulator import FitEmulator
from grouser.scripts.fit_motion import FitMotion
from grouser.scripts.map import Map
from grouser.scripts.montecarlo import MonteCarlo
from grouser.scripts.reproduce import Reproduce
from grouser.scripts.skid_steer import SkidSteer
from grouser.scripts.train import Train
from grouser.scripts.usage import UsageError
from grouser.scripts.watch import Watch
from grouser.scripts.worlds import Worlds


class _Command(Protocol):
    def run(self) -> int:
        """Do it, and return the exit code."""


COMMANDS: dict[str, Callable[..., _Command]] = {
    "abuse": Abuse,
    "compare": Compare,
    "calibrate": Calibrate,
    "evaluate": Evaluate,
    "fit-emulator": FitEmulator,
    "fit-motion": FitMotion,
    "train": Train,
    "map": Map,
    "watch": Watch,
    "worlds": Worlds,
    "montecarlo": MonteCarlo,
    "skid-steer": SkidSteer,
    "reproduce": Reproduce,
}
"""Subcommands by name."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand and return the exit code: 0, 2 for a misuse, 130 when interrupted."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given == ["--version"]:
        print(f"grouser {__version__}")
        return 0
    command: _Command = tyro.extras.subcommand_cli_from_dict(
        COMMANDS,
        prog="grouser",
        description="Tracked robots that navigate on an estimated pose (--version tells which).",
        args=given,
        config=(tyro.conf.FlagCreatePairsOff,),
    )
    _show_log()
    try:
        return command.run()
    except UsageError as error:
        print(f"grouser {given[0]}: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"grouser {given[0]}: interrupted", file=sys.stderr)
        return 130


def _show_log() -> None:
    """Grouser's log on the terminal: why the first start takes long, say."""
    log = logging.getLogger("grouser")
    if not log.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("grouser: %(message)s"))
        log.addHandler(handler)
        log.setLevel(logging.INFO)


if __name__ == "__main__":
    sys.exit(main())
