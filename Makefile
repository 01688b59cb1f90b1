# make run: the main job on a shipped recording. make test: lint, types and a test of everything, in minutes. make
# validate: all tests that take longer. make bench: the co-simulation's speed; make bench-long: memory over a million
# steps; make bench-trace: the tracer on blind recordings, exact and lifelike, goes on where it was stopped; make
# bench-control: the controllers; make bench-campaign: many runs. make docs: the pages in docs/, into build/docs; make
# pictures: those of README and docs that come from runs, and the FMUs' icons. make floors: tests with the lowest
# versions that pyproject.toml declares, on a Python of at most 3.12. Each sets up what it needs.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
PYTEST := python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --durations 20
EXAMPLE := system/tautwire/examples/three
FLOORS := .venv-floors
FLOOR_TESTS := $(addprefix tests/,$(addsuffix .py,cli/test_commands cli/test_input_checks cli/test_material_command \
	cli/test_refused_input control/test_lqg control/test_robust_design cosimulation/test_robot_cosimulation \
	estimation/test_recording_preparation linear/test_linear_plant linear/test_plant_figures project/test_public_names \
	recordings/test_csv_file recordings/test_mat_file recordings/test_mdf_file recordings/test_parquet_file \
	recordings/test_ros_bag reports/test_trace_report_page robot/test_static_equilibrium))

.PHONY: run test tests-in-minutes validate lint types docs pictures floors \
	bench bench-long bench-trace bench-control bench-campaign clean

run: $(READY)
	$(BIN)/tautwire trace $(EXAMPLE)/robot.toml $(EXAMPLE)/fit.csv --check $(EXAMPLE)/check.csv --out build/three

# Tests start hundreds of processes, which would compile every module anew.
unexport PYTHONDONTWRITEBYTECODE

# Two workers on two cores: threads of BLAS would wait for each other.
test tests-in-minutes validate floors: export OPENBLAS_NUM_THREADS = 1

# The type checker has one process, and would leave the other core idle.
test: lint
	$(MAKE) --no-print-directory --jobs 2 types tests-in-minutes

tests-in-minutes: $(READY)
	$(BIN)/$(PYTEST) -m "not validate" -W error::RuntimeWarning

validate: $(READY)
	$(BIN)/$(PYTEST) -m validate
	$(MAKE) floors

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

docs: $(READY)
	NO_MKDOCS_2_WARNING=1 TAUTWIRE_RUN_TUTORIALS=true $(BIN)/mkdocs build --strict --quiet

pictures: $(READY)
	$(BIN)/python -m tests.pictures docs

floors: $(READY)
	$(BIN)/python -m tests.floors > build/floors.txt
	$(PYTHON) -m venv --clear $(FLOORS)
	$(FLOORS)/bin/python -m pip install --quiet --no-compile --constraint build/floors.txt --editable ".[mat,mdf,ros]" \
		pytest-xdist hypothesis
	$(FLOORS)/bin/$(PYTEST) -m "not validate" $(FLOOR_TESTS)

bench: $(READY)
	$(BIN)/python -m tests.bench

bench-long: $(READY)
	$(BIN)/python -m tests.bench.long

bench-trace: $(READY)
	$(BIN)/python -m tests.bench.trace --jobs 2
	$(BIN)/python -m tests.bench.trace --jobs 2 --empty 200
	$(BIN)/python -m tests.bench.trace --jobs 2 --lifelike
	$(BIN)/python -m tests.bench.trace --jobs 2 --lifelike --empty 200
	$(BIN)/python -m tests.bench.trace --jobs 2 --platforms

bench-control: $(READY)
	$(BIN)/python -m tests.bench.control docs

bench-campaign: $(READY)
	$(BIN)/python -m tests.bench.campaign

clean:
	rm -rf $(VENV) $(FLOORS) .venv-wheels build/* dist
	git checkout -- build/README.md
