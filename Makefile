# Each target does all of its set-up; PYTHON names the interpreter to build the environment with.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Tests of whole systems and of the screen have the machine to themselves; the others share its cores.
TIMED := tests/bus tests/bridge tests/system tests/tui
PURE := $(filter-out $(TIMED),$(patsubst %/,%,$(wildcard tests/*/)))

.PHONY: demo test lint bench clean

demo: $(STAMP)
	$(BIN)/touchline demo

test: $(STAMP) lint
	$(BIN)/python -m pytest -q -n 2 $(PURE)
	$(BIN)/python -m pytest -q $(TIMED)

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

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
