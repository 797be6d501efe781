# Each target does all of its set-up; PYTHON names the interpreter to build the environment with.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Tests of whole systems have the machine to themselves; those that mostly wait for others or for the screen share it
# with their like, and so do those that reckon.
SYSTEM := tests/system
WAITING := tests/bus tests/bridge tests/tui
PURE := $(filter-out $(SYSTEM) $(WAITING),$(patsubst %/,%,$(wildcard tests/*/)))

.PHONY: demo test lint bench clean

demo: $(STAMP)
	$(BIN)/touchline demo

test: $(STAMP) lint
	$(BIN)/python -m pytest -q -n 2 $(PURE)
	$(BIN)/python -m pytest -q -n 2 $(WAITING)
	$(BIN)/python -m pytest -q $(SYSTEM)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.house

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
