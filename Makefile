# Each target does all of its set-up; PYTHON names the interpreter to build the environment with.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PRODUCT := $(VENV)/.product
STAMP := $(VENV)/.installed
# Hundreds of processes are started here: without this each would compile all sources where the variable is set.
unexport PYTHONDONTWRITEBYTECODE
# Tests of whole systems, and those that mostly wait for others or for the screen, run beside those that reckon: more of
# them at once than there are cores. What takes longest begins first.
LONGEST := tests/system tests/way_round
TESTS := $(LONGEST) $(filter-out $(LONGEST) tests/__pycache__,$(patsubst %/,%,$(wildcard tests/*/)))

# ROS 2's own tools, which are no part of the tests: wheels, and what they make.
ROS2 := build/ros2

.PHONY: demo test suite test-full quick lint docs linkcheck bytecode tree kernels wheel sbom lock bench ros2-hashes ros2-packages node-readers clean

demo: $(STAMP)
	$(BIN)/touchline demo

# Side by side, so that no core waits: kernels are compiled while packages of tests are installed, and tests run beside
# what checks types.
test:
	$(MAKE) --no-print-directory -j 4 suite lint

suite: kernels bytecode
	$(BIN)/python -m pytest -q -n 4 --dist loadgroup -m "not full" $(TESTS)

# What `test` leaves out: many seeds, vehicles and followers, the published studies, the longer benchmarks, fuzzers.
test-full: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[fuzz]'
	$(BIN)/python -m pytest -q -n 3 --dist loadgroup -m full tests

# Rooms that start no process and compile little.
quick: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/python -m pytest -q -n 2 -m "not full" tests/schemas tests/core tests/drawings tests/imports tests/onboard

lint: $(STAMP) tree
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	PYTHONPATH=build/tree $(BIN)/lint-imports
	$(BIN)/python -m tests.house

# The site, build/docs/index.html.
docs: $(STAMP)
	$(BIN)/python -m sphinx -q -W --keep-going -d build/doctrees docs build/docs

# Links to other hosts, which takes a network; no part of the tests.
linkcheck: $(STAMP)
	$(BIN)/python -m sphinx -q -b linkcheck -D nb_execution_mode=off docs build/linkcheck

# Of the tests, which otherwise every process that tests would make for itself.
bytecode: $(STAMP)
	$(BIN)/python -m pytest -q --collect-only $(TESTS) > /dev/null

# The package in one place, as it is when installed: for type checkers, editors and drawings of the imports.
tree:
	rm -rf build/tree && mkdir -p build/tree/touchline
	ln -s $(abspath $(wildcard src/touchline/*) schemas services tui) build/tree/touchline
	ln -s $(abspath research) build/tree/touchline_research

# On all cores; without it each kernel is compiled when it is first called.
kernels: $(PRODUCT)
	$(BIN)/python kernels.py

# With the code of all kernels in it, for this kind of processor.
wheel: $(STAMP)
	$(BIN)/python kernels.py build/kernels
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist . ./research
	rm -rf research/build

# Of what `touchline[standard]` installs, as CycloneDX: dist/sbom.json.
sbom: $(STAMP)
	$(PYTHON) -m venv --clear build/sbom
	build/sbom/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt '.[standard]'
	mkdir -p dist
	$(BIN)/cyclonedx-py environment --pyproject pyproject.toml --output-reproducible -o dist/sbom.json build/sbom/bin/python

# Hashes of the packages that are installed on machines: deploy/requirements.txt.
lock: $(STAMP)
	$(BIN)/python deploy/lock_packages.py

bench: $(STAMP)
	$(BIN)/python -m benchmarks

# Type hashes by ROS 2's code generator, which tests/rosidl holds ours to.
ros2-hashes: $(STAMP) $(ROS2)/.wheels
	rm -rf $(ROS2)/msg
	$(BIN)/touchline topics --msg-dir $(ROS2)/msg
	$(ROS2)/venv/bin/python tests/rosidl/rosidl_hashes.py $(ROS2)/msg $(wildcard $(ROS2)/install) > $(ROS2)/hashes.json
	cp $(ROS2)/hashes.json tests/rosidl/rosidl_hashes.json

# Our message packages, built by colcon; ros2-hashes compares the hashes in them, too.
ros2-packages: $(ROS2)/.wheels
	rm -rf $(ROS2)/src $(ROS2)/build $(ROS2)/install
	cp -r schemas/msg $(ROS2)/src
	tests/rosidl/build_packages.sh $(ROS2)/venv $(ROS2)

$(ROS2)/.wheels: tests/rosidl/wheels.txt tests/rosidl/install_wheels.sh
	mkdir -p $(ROS2)
	tests/rosidl/install_wheels.sh $(ROS2)/venv $(PYTHON)
	@touch $@

# What viewers draw, read by the libraries of Foxglove and Lichtblick; it takes node and npm.
node-readers: $(STAMP)
	mkdir -p build/node-readers
	cp tests/foreign_readers/package.json build/node-readers/
	npm install --prefix build/node-readers --no-package-lock --no-audit --no-fund --silent
	$(BIN)/python -m pytest -q tests/bridge/test_foreign_readers.py

# Of all packages, compiling every module takes two fifths of the time; those that are imported are compiled then.
$(PRODUCT): pyproject.toml research/pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "Touchline needs Python 3.11 or newer: run make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt \
		-e '.[standard]' -e ./research
	@touch $@

$(STAMP): $(PRODUCT)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt 'touchline[docs,test]'
	@touch $@

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache
