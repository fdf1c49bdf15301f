# make demo   install the core into .venv and run the demonstration
# make test   build the wheel, install it into .venv-test, lint, type-check and test it
# make validate   the long comparisons with measurements and the slow verifications
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.PHONY: help demo test validate lint clean

# The jobs of the demonstration, one a line, in order; the last prints where the report is.
# A job behind '?' needs a measurement: without network and offline folder it says so and is left out.
define DEMO_JOBS
seals run experiment=drop_test
? seals compare experiment=falling_balls only=[tennis_ball,volleyball,whiffle_ball_1,bowling_ball]
endef
export DEMO_JOBS

# Measurements are fetched once from their public address, unless a folder beside the checkout holds them.
OFFLINE = $(wildcard $(CURDIR)/../shared/data)
export SEALS_DATA ?= $(OFFLINE)

# Rigid-body wheels exist for Python 3.10 and 3.11 only; an interpreter without venv does not count.
FIND_PYTHON = for candidate in python3.11 python3.10 python3; do \
	if $$candidate -c 'import sys, ensurepip, venv; sys.exit(sys.version_info[:2] not in ((3, 10), (3, 11)))' >/dev/null 2>&1; \
	then echo $$candidate; exit 0; fi; done; \
	echo 'No Python 3.10 or 3.11 with venv found. Install one:  sudo apt-get install -y python3.11 python3.11-venv' >&2; exit 2
PIP = bin/python -m pip install --quiet --disable-pip-version-check
CONSTRAINTS = constraints/py$$($$venv/bin/python -c 'import sys; print("%d%d" % sys.version_info[:2])').txt
SOURCES = $(shell find seals plugins robots animals conf experiments -type f -not -path '*/__pycache__/*' 2>/dev/null)

help:
	@sed -n '1,3s/^# //p' Makefile

demo: .venv/installed
	@while IFS= read -r job; do \
		[ -n "$$job" ] || continue; need="$${job%%[!?]*}"; job="$${job#\? }"; echo; echo "\$$ $$job"; \
		PATH="$$PWD/.venv/bin:$$PATH" $$job </dev/null || [ -n "$$need" -a $$? = 2 ]; \
	done <<< "$$DEMO_JOBS"

.venv/installed: pyproject.toml setup.py constraints/py310.txt constraints/py311.txt
	@python=$$($(FIND_PYTHON)); venv=.venv; \
	echo "Installing SEALS with $$python into $$venv (about 290 MB to download, once)"; \
	$$python -m venv $$venv; $$venv/$(PIP) -c $(CONSTRAINTS) -e .; touch $@

test: .venv-test/installed lint
	@mkdir -p build/elsewhere; root=$$PWD; \
	cd build/elsewhere; "$$root/.venv-test/bin/python" -m mypy --config-file "$$root/pyproject.toml" -p seals
	@.venv-test/bin/pytest -q -c pyproject.toml --rootdir . --doctest-modules --pyargs seals
	@.venv-test/bin/pytest -n 2

validate: .venv-test/installed
	@.venv-test/bin/pytest -m "slow or validation"

lint: .venv-test/installed
	@.venv-test/bin/ruff check .
	@.venv-test/bin/ruff format --check .

# the tests see what a user installs: the wheel, not the checkout
.venv-test/installed: .venv-test/tools $(SOURCES)
	@rm -rf build/lib build/bdist.* build/wheel; \
	.venv-test/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .; \
	.venv-test/$(PIP) --no-deps --force-reinstall build/wheel/aam_seals-*.whl; touch $@

.venv-test/tools: pyproject.toml setup.py constraints/py310.txt constraints/py311.txt
	@python=$$($(FIND_PYTHON)); venv=.venv-test; \
	$$python -m venv $$venv; $$venv/$(PIP) -c $(CONSTRAINTS) '.[dev]'; touch $@

clean:
	rm -rf build dist .venv .venv-test *.egg-info .mypy_cache .ruff_cache .pytest_cache
