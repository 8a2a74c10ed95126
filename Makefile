PYTHON ?= python3
BIN := .venv/bin

.PHONY: help setup report table1 studies gauntlet docs lint test-fast test test-long test-all coverage mutants fuzz strangers bench lock clean

help:  ## list the targets
	@grep -E '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

setup: .venv/ready  ## make .venv with everything in it (once)

.venv/ready: pyproject.toml requirements.lock
	$(PYTHON) -c 'import sys; sys.exit("lightloc needs Python 3.11 to 3.13, this is " + sys.version.split()[0]) if not (3, 11) <= sys.version_info[:2] <= (3, 13) else None'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock -e '.[dev]'
	@touch $@

report: setup  ## render the standard suite, find the lights, write report/index.html
	$(BIN)/lightloc validate --out report
	$(BIN)/lightloc report report

table1: setup  ## the paper's Table 1 over all 800 scenes, beside the paper's figures; resumes
	$(BIN)/lightloc study table1 --out report/studies

studies: setup  ## many lights, occluders, coverage, noise, wrong models, rivals; hours; resumes
	$(BIN)/lightloc study many occluders coverage noise points wrong rooms3d rivals --out report/studies

gauntlet: setup  ## rooms as they are: noise unknown, faults of the model, how many lights; hours; resumes
	$(BIN)/lightloc study gauntlet --out report/studies

docs: setup  ## the book, docs/_build/html/index.html
	$(BIN)/sphinx-build -E -W --keep-going -q -b html docs docs/_build/html

lint: setup  ## style, types, and which file may import which
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

PYTEST := $(BIN)/python -m pytest -n 2 --dist loadfile

test-fast: lint  ## laws, agreement with the renderer, prose: in two minutes
	$(PYTEST) -m 'not long and not slow' tests/laws tests/agreement tests/prose

test: lint  ## all that CI runs: in ten minutes
	$(PYTEST) -m 'not long'

test-long: lint  ## the rest: mutants, and the solve rate on the hard set; five minutes
	$(BIN)/python -m pytest -m long

test-all: setup  ## the fast tests on Python 3.11 to 3.13, with the oldest and the newest libraries
	$(BIN)/tox

coverage: setup  ## which lines the fast tests and the harness run
	$(PYTEST) --cov --cov-report=term-missing:skip-covered tests/laws tests/agreement tests/prose tests/harness -m 'not long'

mutants: setup  ## break our own code in 198 ways; each must fail a test
	$(BIN)/python tests/mutants/run.py

fuzz: setup  ## give 5000 odd files and command lines to all that reads input: no fault
	$(BIN)/python tests/fuzz/run.py

strangers: setup  ## scenes as strangers write them, each in four variants, against Mitsuba; half an hour
	$(BIN)/python tests/strangers/run.py

bench: setup  ## benchmarks, as ratios within one run
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only -s

lock:  ## pin the versions that pip picks today
	$(PYTHON) -m venv .lock
	.lock/bin/pip install --quiet -e '.[dev]'
	.lock/bin/pip freeze --exclude-editable > requirements.lock
	rm -rf .lock

clean:  ## remove what was built
	rm -rf .venv report build dist docs/_build docs/drawn
