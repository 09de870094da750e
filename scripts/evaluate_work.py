"""What `grouser evaluate` does with its options: prepare, drive, score, report."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from grouser import __version__
from grouser.agents.drivers import make_driver
from grouser.agents.episode import Episode, Trial, goal_task, run_trial
from grouser.agents.evaluation import (
    BASELINE,
    Contrast,
    Gap,
    Score,
    contrast,
    open_closed_gap,
    score,
)
from grouser.agents.open_loop import replayed_ate
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.scripts.compare_world import world_options
from grouser.scripts.evaluate import Evaluate
from grouser.scripts.evaluate_folder import EvaluationFolder, Watched, key_of
from grouser.scripts.evaluate_plot import plot_latencies
from grouser.scripts.evaluate_table import contrast_words, gap_words, score_table, short_names
from grouser.scripts.ray_cluster import require_cluster
from grouser.scripts.sweep import sweep
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of the work: drive an episode, or let an estimator watch one."""

    trial: Trial
    watch: bool


def evaluate(options: Evaluate) -> int:
    """Evaluate, print the table, and return the exit code."""
    console = table_console()
    with usage_errors():
        _check(options)
        folder = EvaluationFolder(_output(options), _settings(options), resume=options.resume)
    finished = _work(options, folder)
    _report(options, folder, console)
    return 0 if finished else 130


def do_piece(piece: Piece) -> Episode | Watched:
    """One piece, here or in another process."""
    trial = piece.trial
    if not piece.watch:
        return run_trial(trial)
    ate = replayed_ate(trial)
    return Watched(trial.policy, trial.estimator, trial.seed, ate, trial.pose_latency)


def _check(options: Evaluate) -> None:
    """Everything that can be refused is refused here, before any long work."""
    for name in ("episodes", "goals", "processes"):
        value = getattr(options, name)
        if value is not None and value < 1:
            raise UsageError(f"--{name} must be at least 1, got {value}")
    if options.seed < 0:
        raise UsageError(f"--seed must be at least 0, got {options.seed}")
    if options.resume and options.output is None:
        raise UsageError("--resume needs --output: the folder of the results to complete")
    if not options.policy or not options.estimators or not options.pose_latency:
        raise UsageError("--policy, --estimators and --pose-latency take one value or more")
    for policy, latency in product(options.policy, options.pose_latency):
        for estimator in _driven(options):
            goal_task(make_driver(policy), estimator, task_of(options, latency)).close()
    if _is_sweep(options) and not options.no_plots:
        require_matplotlib()
    if options.ray is not None:
        require_cluster(options.ray)


def task_of(options: Evaluate, pose_latency: float) -> dict[str, Any]:
    """The arguments of `GoalNavEnv`, but those that the driver or the estimator decides."""
    return {**_common_task(options), "pose_latency": pose_latency}


def _common_task(options: Evaluate) -> dict[str, Any]:
    robot = world_options(
        difficulty=options.difficulty,
        terrain=options.terrain,
        randomize=options.randomize,
        dynamics=options.dynamics,
        renderer=None,
        effects=options.effects,
        faults=options.faults,
    )
    return {
        "world": options.world,
        "goals": options.goals,
        "time_limit": options.time_limit,
        "robot": robot,
    }


def _settings(options: Evaluate) -> dict[str, Any]:
    """More episodes, estimators, drivers or latencies may be added to a folder; its task stays."""
    return {"grouser": __version__, **_common_task(options)}


def _output(options: Evaluate) -> Path:
    if options.output is not None:
        return options.output
    return Path("results") / f"evaluate-{options.world}-{datetime.now():%Y%m%d-%H%M%S}"


def _driven(options: Evaluate) -> list[str]:
    """Estimators to drive with: those asked for, and what they are measured against."""
    return list(dict.fromkeys((BASELINE, *options.estimators)))


def _seeds(options: Evaluate) -> range:
    return range(options.seed, options.seed + options.episodes)


def pieces_of(options: Evaluate, folder: EvaluationFolder) -> list[Piece]:
    """What is still to be done, an episode of every estimator before the next one of any."""
    pieces = []
    for seed in _seeds(options):
        for policy, latency in product(options.policy, options.pose_latency):
            for estimator in _driven(options):
                trial = Trial(policy, estimator, seed, task_of(options, latency))
                if key_of(trial) not in folder.episodes:
                    pieces.append(Piece(trial, watch=False))
                if options.open_loop and key_of(trial) not in folder.watched:
                    pieces.append(Piece(trial, watch=True))
    return pieces


def _work(options: Evaluate, folder: EvaluationFolder) -> bool:
    """Do it under a progress bar, each piece on disk when it is done; whether it was finished."""
    pieces = pieces_of(options, folder)
    processes = options.processes or len(os.sched_getaffinity(0))
    with progress("episodes", len(pieces)) as bar:
        try:
            for _, done in sweep(do_piece, pieces, processes=processes, ray=options.ray):
                folder.add(done)
                bar.advance()
        except KeyboardInterrupt:
            return False
    return True


def _report(options: Evaluate, folder: EvaluationFolder, console: Console) -> None:
    scores = scores_of(options, folder)
    if not scores:
        console.print("interrupted before every estimator had an episode: there are no scores")
        return
    gaps, contrasts = gaps_of(options, folder, scores), contrasts_of(options, folder)
    folder.report(scores, gaps, contrasts)
    console.print(score_table(scores, f"{options.world}, {options.goals} goal(s) an episode"))
    names = short_names([score.policy for score in scores])
    for words in (*map(gap_words, gaps), *(contrast_words(c, names) for c in contrasts)):
        console.print(words)
    if _is_sweep(options) and not options.no_plots:
        console.print(f"plot: {plot_latencies(folder.path, scores)}")
    console.print(f"{len(folder.episodes)} episodes in {folder.path}: results.json, episodes.json")


def _is_sweep(options: Evaluate) -> bool:
    return len(set(options.pose_latency)) > 1


def scores_of(options: Evaluate, folder: EvaluationFolder) -> list[Score]:
    """A score for every driver, latency and estimator that was asked for, over the episodes that
    all estimators have finished."""
    scores = []
    for policy, latency in product(options.policy, options.pose_latency):
        seeds = _finished(options, folder, (policy,), latency)
        if seeds:
            truth = _episodes(folder, policy, BASELINE, latency, seeds)
            scores += [
                score(_episodes(folder, policy, name, latency, seeds), truth)
                for name in options.estimators
            ]
    return scores


def contrasts_of(options: Evaluate, folder: EvaluationFolder) -> list[Contrast]:
    """What every other driver gains over the first, over the episodes that all have finished."""
    first, *others = options.policy
    contrasts = []
    for policy, latency in product(others, options.pose_latency):
        seeds = _finished(options, folder, (first, policy), latency)
        for name in options.estimators if seeds else ():
            mine, theirs = (_episodes(folder, who, name, latency, seeds) for who in (policy, first))
            contrasts.append(contrast(mine, theirs))
    return contrasts


def _finished(
    options: Evaluate, folder: EvaluationFolder, policies: Sequence[str], latency: float
) -> list[int]:
    """Seeds of which these drivers have an episode with every estimator."""
    pairs = list(product(policies, _driven(options)))
    return [
        seed
        for seed in _seeds(options)
        if all((policy, name, latency, seed) in folder.episodes for policy, name in pairs)
    ]


def _episodes(
    folder: EvaluationFolder, policy: str, estimator: str, latency: float, seeds: Sequence[int]
) -> list[Episode]:
    return [folder.episodes[policy, estimator, latency, seed] for seed in seeds]


def gaps_of(options: Evaluate, folder: EvaluationFolder, scores: Sequence[Score]) -> list[Gap]:
    """The open-closed gap of every driver, where it was asked for; the true pose takes no part."""
    if not options.open_loop:
        return []
    gaps = []
    for policy, latency in product(options.policy, options.pose_latency):
        spl = {
            s.estimator: s.spl for s in scores if (s.policy, s.pose_latency) == (policy, latency)
        }
        spl.pop(BASELINE, None)
        if len(spl) > 1:
            ates = {name: _mean_ate(options, folder, policy, name, latency) for name in spl}
            gaps.append(open_closed_gap(policy, ates, spl, pose_latency=latency))
    return gaps


def _mean_ate(
    options: Evaluate, folder: EvaluationFolder, policy: str, estimator: str, latency: float
) -> float:
    keys = [(policy, estimator, latency, seed) for seed in _seeds(options)]
    return float(np.mean([folder.watched[key].ate_m for key in keys if key in folder.watched]))
