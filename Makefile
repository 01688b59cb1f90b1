# make run: the main job on a shipped recording. make test: lint, types and all tests. make bench: the co-simulation's
# speed; make bench-long: memory over a million steps; make bench-trace: the tracer on blind recordings, goes on where it
# was stopped; make bench-control: the controllers. Each sets up what it needs.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
EXAMPLE := system/tautwire/examples/three

.PHONY: run test lint types bench bench-long bench-trace bench-control clean

run: $(READY)
	$(BIN)/tautwire trace $(EXAMPLE)/robot.toml $(EXAMPLE)/fit.csv --check $(EXAMPLE)/check.csv --out build/three

test: lint types
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@

bench: $(READY)
	$(BIN)/python -m tests.bench

bench-long: $(READY)
	$(BIN)/python -m tests.bench.long

bench-trace: $(READY)
	$(BIN)/python -m tests.bench.trace --jobs 2
	$(BIN)/python -m tests.bench.trace --jobs 2 --empty 200

bench-control: $(READY)
	$(BIN)/python -m tests.bench.control docs

clean:
	rm -rf $(VENV) build/* dist
	git checkout -- build/README.md
