# Each target does all of its set-up; PYTHON names the interpreter to build the environment with.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Hundreds of processes are started here: without this each would compile all sources where the variable is set.
unexport PYTHONDONTWRITEBYTECODE
# Tests of whole systems, and those that mostly wait for others or for the screen, run beside those that reckon: more of
# them at once than there are cores. What takes longest begins first.
TESTS := tests/system $(filter-out tests/system,$(patsubst %/,%,$(wildcard tests/*/)))

.PHONY: demo test lint planner-kernels robot-kernels bench clean

demo: $(STAMP)
	$(BIN)/touchline demo

test: $(STAMP)
	$(MAKE) --no-print-directory -j 3 planner-kernels robot-kernels lint
	$(BIN)/python -m pytest -q -n 3 --dist loadgroup $(TESTS)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.house

# Each kernel is compiled by one process, beside what lint does: two that test would each compile most of them.
planner-kernels: $(STAMP)
	$(BIN)/touchline plan tennis > /dev/null

robot-kernels: $(STAMP)
	$(BIN)/python -c 'from touchline.services.robot_sim.warm_up import warm_up; warm_up()'
	$(BIN)/touchline fleet simulate --robots 1 --duration 1 > /dev/null

bench: $(STAMP)
	$(BIN)/python -m benchmarks

$(STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Touchline needs Python 3.11 or newer: run make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test]'
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache
