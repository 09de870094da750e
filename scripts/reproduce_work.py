"""What `grouser reproduce` does with its options: prepare, experiment, write the page."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from grouser import __version__
from grouser.estimators.evaluation.folder import write_json
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.kernels import announce
from grouser.scripts.reproduce import Reproduce
from grouser.scripts.reproduction.execution import execute
from grouser.scripts.reproduction.experiment import Experiment
from grouser.scripts.reproduction.html import render
from grouser.scripts.reproduction.paper import Paper
from grouser.scripts.reproduction.store import ExperimentStore
from grouser.scripts.reproduction.yan import scale as yan_scale
from grouser.scripts.reproduction.yan.reproduction import Yan
from grouser.scripts.reproduction.zhao import scale as zhao_scale
from grouser.scripts.reproduction.zhao.contenders import contenders
from grouser.scripts.reproduction.zhao.reproduction import Zhao
from grouser.scripts.terminal import progress
from grouser.scripts.usage import UsageError, usage_errors


@dataclass(frozen=True, slots=True)
class _Plan:
    """A reproduction that was found to be possible."""

    paper: Paper
    store: ExperimentStore
    jobs: int

    @property
    def missing(self) -> list[Experiment]:
        return [e for e in self.paper.experiments() if not self.store.has(e.name)]


def reproduce(options: Reproduce) -> int:
    """Do what is missing, write the page, say where it is, and return the exit code."""
    with usage_errors():
        plan = _prepare(options)
    plan.store.begin()
    if not _work(plan):
        print(f"interrupted; what is done is kept: go on with --output {plan.store.path} --resume")
        return 130
    _write(plan)
    return 0


def _prepare(options: Reproduce) -> _Plan:
    """Everything that can be refused is refused here, before any long work."""
    if options.jobs < 1:
        raise UsageError(f"--jobs must be at least 1, got {options.jobs}")
    if options.resume and options.output is None:
        raise UsageError("--resume needs --output: the folder to go on with")
    require_matplotlib(otherwise="; a page without figures is none")
    paper = _paper(options)
    settings = {
        "grouser": __version__,
        "paper": options.paper,
        "quick": options.quick,
        **paper.settings,
    }
    store = ExperimentStore(_output(options), settings, resume=options.resume)
    return _Plan(paper, store, options.jobs)


def _paper(options: Reproduce) -> Paper:
    if options.paper == "zhao":
        scale = zhao_scale.QUICK if options.quick else zhao_scale.FULL
        return Zhao(contenders(options.estimators), scale)
    if options.estimators:
        raise UsageError(
            "--estimators is of zhao, whose page compares estimators; the page of yan is about "
            "one filter and its forms: leave --estimators out"
        )
    return Yan(yan_scale.QUICK if options.quick else yan_scale.FULL)


def _output(options: Reproduce) -> Path:
    if options.output is not None:
        return options.output
    return Path("results") / f"reproduce-{options.paper}-{datetime.now():%Y%m%d-%H%M%S}"


def _work(plan: _Plan) -> bool:
    """Do the missing experiments under a progress bar; whether they were left to finish."""
    missing = plan.missing
    announce()
    with progress("", sum(experiment.parts for experiment in missing)) as bar:
        try:
            execute(
                missing,
                plan.store,
                jobs=plan.jobs,
                on_experiment=bar.describe,
                on_parts=bar.advance,
            )
        except KeyboardInterrupt:
            return False
    return True


def _write(plan: _Plan) -> None:
    outcomes = {e.name: plan.store.read(e.name) for e in plan.paper.experiments()}
    figures = plan.paper.figures(outcomes)
    path = plan.store.path / "page.html"
    path.write_text(render(plan.paper.page(outcomes, figures), figures))
    write_json(plan.store.path / "results.json", figures)
    print(f"{path}, and its {len(figures)} numbers in {plan.store.path / 'results.json'}")
