# One command sets up and checks. Needs git, make and Python 3.11 or newer with venv.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3; do \
	$$p -c 'import sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
LOCK := requirements-dev.lock
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

.PHONY: help setup demo test lock evaluate tables bench clean

help: ## this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /\1\t/' | expand -t 12

setup: compiled ## .venv with sitl-emu in it: afterwards .venv/bin/sitl-emu is the command line

.venv/bin/python:
	@test -n "$(PYTHON)" || { echo "no Python 3.11 or newer with venv found: apt install python3 python3-venv, or make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv .venv

# The rooms at the top are packages of sitl_emu (setup.py); mypy and import-linter, which know no setup.py, find them by
# links, which git ignores. --no-compile: see bytecode.
.venv/.installed: pyproject.toml setup.py | .venv/bin/python
	@echo "installing sitl-emu and what it needs, half a minute and the download..."
	@$(PIP) install --no-compile -e .
	@for room in vehicles autopilot gcs missions; do ln -sfn ../$$room sitl_emu/$$room; done
	@touch $@

# Three kinds of compiling side by side: two minutes instead of three on two cores.
.venv/.run-ready: .venv/.installed
	@$(MAKE) --no-print-directory --jobs 3 modules kernels bytecode
	@touch $@

.PHONY: modules kernels bytecode compiled
# What runs in every tick is compiled, where there is a C compiler (sitl_emu/compiled.py): a minute once, and two fifths of
# the CPU saved ever after. Where that fails, all works as plain Python; `make test` does fail then.
COMPILE := $(BIN)/python tools/compile_hot_modules.py
modules:
	@! command -v cc >/dev/null || $(BIN)/python -c 'import mypyc' 2>/dev/null || $(PIP) install --constraint $(LOCK) mypy setuptools
	@$(COMPILE) || echo "not compiled: the autopilot runs as plain Python, at two thirds of its speed" >&2

# A camera's first frame would wait for numba. The corn field has kernels of its own, and draws with the renderer's.
kernels:
	@echo "compiling what cameras draw with, half a minute..."
	@$(BIN)/python -m sitl_emu.world.render
	@$(BIN)/python -m sitl_emu.world.kinds.corn_field

# As pip would, which takes as long for it as for all else. Packages may carry files for another Python, which fail.
# The dialect alone is two megabytes of source, half a second of every start where nothing keeps its bytecode.
bytecode:
	@$(BIN)/python -m compileall -qq .venv/lib || true
	@$(BIN)/python -m compileall -q sitl_emu vehicles autopilot gcs missions

compiled: .venv/.run-ready
	@$(MAKE) --no-print-directory modules

# What the tests and checks run with is locked (requirements-dev.lock); what users install has lower bounds (pyproject).
# --no-deps: the lock is complete, but for the viewers that MAVProxy's wheel asks for (vtk, opencv-python).
# --target: both MAVSDKs, native and gRPC, are called mavsdk; a test of the older one puts this folder first.
.venv/.dev-ready: .venv/.run-ready $(LOCK)
	$(PIP) install --no-deps -r $(LOCK)
	sed -n 's/^# mavsdk3: //p' $(LOCK) > .venv/mavsdk3.txt
	$(PIP) install --no-deps --upgrade --target .venv/mavsdk3 -r .venv/mavsdk3.txt
	@touch $@

# uv resolves for every Python and platform at once (--universal), which pip-tools does not; pip alone installs.
UV = .venv/uv/bin/uv pip compile --quiet --universal --python-version 3.11 --no-annotate --no-header
lock: .venv/bin/python ## the newest versions of what development needs, into requirements-dev.lock
	$(PYTHON) -m venv .venv/uv && .venv/uv/bin/python -m pip --quiet install uv
	printf '%s\n' vtk opencv-python quantized-mesh-tile > .venv/excluded.txt
	echo '# Made by `make lock`; the older MAVSDK, which is installed apart, in the comments at the end.' > $(LOCK).new
	echo MAVProxy | $(UV) --extra dev --excludes .venv/excluded.txt pyproject.toml - >> $(LOCK).new
	echo 'mavsdk<4' | $(UV) - | sed 's/^/# mavsdk3: /' >> $(LOCK).new
	mv $(LOCK).new $(LOCK)

# node-mavlink, a second MAVLink implementation, for one interop test, which is skipped, and says so, where it is missing.
NODE := tests/interop/node
$(NODE)/node_modules/.package-lock.json: $(NODE)/package-lock.json
	@command -v npm >/dev/null && npm ci --prefix $(NODE) --no-audit --no-fund --loglevel=error \
		|| echo "no node-mavlink (needs npm): tests/interop/test_node_mavlink.py will be skipped" >&2

demo: setup ## the agriculture mission with a live view; names its report at the end
	$(BIN)/sitl-emu run agriculture --speed max

test: .venv/.dev-ready $(NODE)/node_modules/.package-lock.json ## every check: format, lint, types, room borders, tests
	$(COMPILE)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory --jobs 4 --output-sync=line $(SUITES)

# Side by side: half of the tests wait for vehicles that fly in real time. Those of a folder share ports and autopilots;
# flight and unit have none.
SUITES := test-interop test-conformance test-missions test-unit
.PHONY: $(SUITES)
test-interop:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/interop
test-conformance:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/conformance
test-missions:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/missions
test-unit:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/flight tests/unit

evaluate: .venv/.dev-ready compiled ## the agriculture mission over seeds 1 to 10: prints the table, fails where a row falls short
	$(BIN)/python tools/evaluate.py agriculture

tables: .venv/.dev-ready compiled ## the disaster mission's campaigns, hours of them: prints every table beside the paper's (ARGS="--only 5")
	$(BIN)/python tools/disaster/paper_tables.py $(ARGS)

bench: .venv/.dev-ready compiled ## cost of a tick (physics, autopilot, rendering), memory of a fleet
	for bench in tools/bench_*.py; do $(BIN)/python $$bench || exit 1; done

clean: ## remove .venv and caches, keep runs
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist *.egg-info
