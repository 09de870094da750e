"""The folder of an evaluation, which grows by an episode at a time.

results.json    a list with an object an estimator (and driver, and latency): its scores
episodes.json   a list with an object an episode
open_loop.json  a list with an object an estimator and drive that it watched: its error
gap.json        a list with an object a driver: both orders of the estimators, Kendall's tau
drivers.json    a list with an object an estimator and driver: what it gains over the first driver
settings.json   what all of it has in common
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from grouser.agents.episode import Episode, Trial
from grouser.agents.evaluation import Contrast, Gap, Score
from grouser.estimators.evaluation.folder import (
    HELD,
    Settings,
    read_json,
    require_ready,
    write_json,
    write_settings,
)

Key = tuple[str, str, float, int]
"""Driver, estimator, latency and seed: what an episode is known by within a folder."""


@dataclass(frozen=True, slots=True)
class Watched:
    """The error of an estimator on a drive that it had no say in."""

    policy: str
    estimator: str
    seed: int
    ate_m: float
    pose_latency: float = 0.0


class EvaluationFolder:
    """What is done of an evaluation; on disk after each piece, in an order of its own."""

    def __init__(self, path: Path, settings: Settings, *, resume: bool) -> None:
        """Begin the folder, or go on with one that was begun with the same settings.

        Raises:
            ValueError: the folder cannot be written to, or it holds results already and `resume`
                is not set, or it holds those of other settings, or its files are damaged.
        """
        self.path, self._settings = path, settings
        self.episodes: dict[Key, Episode] = {}
        self.watched: dict[Key, Watched] = {}
        begun = (path / "settings.json").exists()
        require_ready(path, settings, begun=begun, resume=resume, holds=HELD)
        if not begun:
            return
        self.episodes = {key_of(e): e for e in self._read("episodes.json", Episode)}
        self.watched = {key_of(w): w for w in self._read("open_loop.json", Watched)}

    def add(self, done: Episode | Watched) -> None:
        """Keep a piece of the work."""
        if isinstance(done, Episode):
            self.episodes[key_of(done)] = done
            self._write("episodes.json", _sorted(self.episodes))
        else:
            self.watched[key_of(done)] = done
            self._write("open_loop.json", _sorted(self.watched))

    def report(
        self, scores: Sequence[Score], gaps: Sequence[Gap], contrasts: Sequence[Contrast]
    ) -> None:
        """Keep what follows from all of it."""
        self._write("results.json", scores)
        if gaps:
            self._write("gap.json", gaps)
        if contrasts:
            self._write("drivers.json", contrasts)

    def _write(self, name: str, values: Sequence[Any]) -> None:
        self.path.mkdir(parents=True, exist_ok=True)
        write_settings(self.path, self._settings)
        write_json(self.path / name, [asdict(value) for value in values])

    def _read(self, name: str, kind: type[Any]) -> list[Any]:
        path = self.path / name
        if not path.exists():
            return []
        try:
            return [kind(**told) for told in read_json(path, list)]
        except TypeError as error:
            raise ValueError(
                f"{path} cannot be resumed from: {error}; choose another --output"
            ) from error


def key_of(what: Trial | Episode | Watched) -> Key:
    """What it is known by."""
    return what.policy, what.estimator, what.pose_latency, what.seed


def _sorted(kept: dict[Key, Any]) -> list[Any]:
    return [kept[key] for key in sorted(kept)]
