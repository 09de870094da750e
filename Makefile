# Two commands from a fresh clone: `make demo` and `make test`. Each makes .venv when it is missing or
# stale. Needs Python 3.11 or 3.10; PYTHON=/path/to/python chooses one, VENV=folder another place.

VENV ?= .venv
PYTHON ?=
export VENV PYTHON
RUN = $(VENV)/bin/python -m

.PHONY: help demo test lint clean

help: ## say what can be made
	@sed -n 's/^\([a-z]*\):.*## /  make \1|/p' $(firstword $(MAKEFILE_LIST)) | \
	  while IFS='|' read -r command purpose; do printf '%-14s%s\n' "$$command" "$$purpose"; done

demo: ## compare four pose estimators on the simulated robot; table, plots and results in results/
	@.ci/ensure-venv plot
	$(RUN) grouser.scripts.cli compare --seeds 2 \
	  --estimators ground-truth dead-reckoning one-point-ransac five-point-ransac

test: ## run the tests
	@.ci/ensure-venv dev
	$(RUN) pytest -n 2

lint: ## check style and types
	@.ci/ensure-venv dev
	$(RUN) ruff check
	$(RUN) ruff format --check
	$(RUN) mypy

clean: ## remove the virtual environment, caches and builds, but no results
	[ ! -f $(VENV)/pyvenv.cfg ] || rm -rf $(VENV)
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +
