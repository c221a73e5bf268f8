# One command sets up and checks. Needs git, make and Python 3.11 or newer with venv.
PYTHON ?= $(shell for p in python3.11 python3.12 python3.13 python3; do \
	$$p -c 'import sys, venv; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

.PHONY: help setup demo test evaluate bench clean

help: ## this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /\1\t/' | expand -t 12

setup: .venv/.run-ready ## .venv with sitl-emu in it: afterwards .venv/bin/sitl-emu is the command line

.venv/bin/python:
	@test -n "$(PYTHON)" || { echo "no Python 3.11 or newer with venv found: apt install python3 python3-venv, or make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv .venv

# compileall: the dialect alone is two megabytes of source, half a second of every start where nothing keeps its bytecode.
.venv/.run-ready: pyproject.toml setup.py | .venv/bin/python
	$(PIP) install -e .
	$(BIN)/python -m compileall -q sitl_emu vehicles autopilot gcs missions
	@touch $@

# --no-deps: MAVProxy's wheel asks for viewers (vtk, opencv-python) that a test without a display never opens.
# --target: both MAVSDKs, native and gRPC, are called mavsdk; a test of the older one puts this folder first.
.venv/.dev-ready: .venv/.run-ready
	$(PIP) install -e '.[dev]'
	$(PIP) install --no-deps MAVProxy
	$(PIP) install --upgrade --target .venv/mavsdk3 'mavsdk<4'
	@touch $@

# node-mavlink, a second MAVLink implementation, for one interop test, which is skipped, and says so, where it is missing.
NODE := tests/interop/node
$(NODE)/node_modules/.package-lock.json: $(NODE)/package-lock.json
	@command -v npm >/dev/null && npm ci --prefix $(NODE) --no-audit --no-fund --loglevel=error \
		|| echo "no node-mavlink (needs npm): tests/interop/test_node_mavlink.py will be skipped" >&2

demo: setup ## the agriculture mission with a live view; names its report at the end
	$(BIN)/sitl-emu run agriculture --speed max

test: .venv/.dev-ready $(NODE)/node_modules/.package-lock.json ## every check: format, lint, types, room borders, tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(MAKE) --no-print-directory --jobs 3 --output-sync=line $(SUITES)

# Side by side: half of the tests wait for vehicles that fly in real time. Those of a folder share ports and autopilots.
SUITES := test-interop test-conformance test-others
.PHONY: $(SUITES)
test-interop:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/interop
test-conformance:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/conformance
test-others:
	$(BIN)/python -m pytest -q -p no:cacheprovider tests/missions tests/flight tests/unit

evaluate: .venv/.dev-ready ## the agriculture mission over seeds 1 to 10: prints the table, fails where a row falls short
	$(BIN)/python tools/evaluate.py

bench: .venv/.dev-ready ## cost of a tick (physics, autopilot, rendering), memory of a fleet
	for bench in tools/bench_*.py; do $(BIN)/python $$bench || exit 1; done

clean: ## remove .venv and caches, keep runs
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist *.egg-info
