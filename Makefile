# make demo   install the core into .venv and run the demonstration; with another Python: PYTHON=python3.13
# make test   build the wheel, install it into .venv-test, lint, type-check and test it
# make thorough   the tests that take seconds each and have cheaper ones beside them in make test
# make test-kernels   the tests of numbers once more with the arithmetic of an older processor
# make docs   build this documentation into build/site; a warning is an error
# make pages  run every command of every page, the slow ones too, and compare what it prints
# make validate   the long comparisons with measurements and the slow verifications
# make killed   kill every long command at random moments; fill a disk; fail every write of it; take out every guard
# make golden  what every experiment, shipped log and training answers, compared with build/golden.json; recorded there first
# make speed    ten cases beside the bare engine, compared with build/speed.json, which keeps the last table
# make fuzz     damaged files for every reader and loader, 3 minutes each
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
# pages that make pages follows at a time
PAGES_JOBS ?= 2
.PHONY: help demo test thorough test-kernels types examples docs pages browser validate killed fuzz golden speed lint clean

# The jobs of the demonstration, one a line, in order.
# A job behind '?' needs a measurement: without an offline folder it may fail for want of a network,
# says so and is left out.
# A job behind '=N' must end with exit code N: a diagnosis that names an effect ends with 10.
LOOP = runs/demo
define DEMO_JOBS
seals run experiment=drop_test
? seals compare experiment=falling_balls only=[tennis_ball,volleyball,whiffle_ball_1,bowling_ball]
=10 seals diagnose log=hidden_effect/flight_a out=$(LOOP)
seals add diagnosis=$(LOOP) name=my_model folder=$(LOOP) replace=true
seals verify log=hidden_effect/flight_b model=$(LOOP)/my_model.yaml out=$(LOOP)
endef
export DEMO_JOBS

# Measurements are fetched once from their public address, unless a folder beside the checkout holds them.
OFFLINE = $(wildcard $(CURDIR)/../shared/data)
export SEALS_DATA ?= $(OFFLINE)

# many small matrices: threads inside the linear algebra only get into each other's way
test thorough test-kernels validate pages killed fuzz golden speed: export OPENBLAS_NUM_THREADS = 1

# PyBullet has wheels for Python 3.10 and 3.11, so those come first; an interpreter without venv does not count.
FIND_PYTHON = for candidate in $${PYTHON:-python3.11 python3.10 python3 python3.12 python3.13}; do \
	if $$candidate -c 'import sys, ensurepip, venv; sys.exit(sys.version_info[:2] < (3, 10))' >/dev/null 2>&1; \
	then echo $$candidate; exit 0; fi; done; \
	echo 'No Python from 3.10 on with venv found. Install one:  sudo apt-get install -y python3 python3-venv' >&2; exit 2
PIP = bin/python -m pip install --quiet --disable-pip-version-check
# the tests need torch, and of torch only the processor's build
TORCH_INDEX = https://download.pytorch.org/whl/cpu
# versions that were tested together, where there is a list for this Python
CONSTRAINED = $$(list=constraints/py$$($$venv/bin/python -c 'import sys; print("%d%d" % sys.version_info[:2])').txt; \
	[ ! -f $$list ] || echo "-c $$list")
LISTS = $(wildcard constraints/py*.txt)
SOURCES = $(shell find seals plugins robots animals conf experiments -type f -not -path '*/__pycache__/*' 2>/dev/null)

help:
	@sed -n '1,11s/^# //p' Makefile

demo: .venv/installed
	@while IFS= read -r job; do \
		[ -n "$$job" ] || continue; mark=; allowed=0; \
		case "$$job" in "? "*|=*) mark="$${job%% *}"; job="$${job#* }";; esac; \
		case "$$mark" in =*) allowed="$${mark#=}";; esac; \
		echo; echo "\$$ $$job"; code=0; \
		PATH="$$PWD/.venv/bin:$$PATH" $$job </dev/null || code=$$?; \
		[ $$code = $$allowed ] || [ "$$mark" = "?" -a $$code = 2 -a -z "$$SEALS_DATA" ] || \
			{ echo "make demo: '$$job' ended with exit code $$code instead of $$allowed." >&2; exit 1; }; \
	done <<< "$$DEMO_JOBS"
	@echo "$(LOOP)/ladder.png: the error ladder as a picture"
	@echo "$(LOOP)/report.html: the report of the diagnosis"

.venv/installed: pyproject.toml setup.py $(LISTS)
	@python=$$($(FIND_PYTHON)); venv=.venv; \
	echo "Installing SEALS with $$python into $$venv (about 350 MB to download, once)"; \
	$$python -m venv $$venv; $$venv/$(PIP) $(CONSTRAINED) -e .; touch $@

# which tests make test runs; the check of a change takes the pages of make thorough along, in one go:
# each start of pytest reads all files, and each process makes its tables, once
TESTED ?= not thorough and not slow and not killed

# one process each, so two at a time: types, examples; then the tests, on two cores: one builds the documentation
test: .venv-test/installed lint browser
	@$(MAKE) --no-print-directory -j 2 types examples
	@.venv-test/bin/pytest -n 2 --dist worksteal -m "$(TESTED)"

# the rest of the tests that take no minutes; a change must pass them, too, before it is proposed
thorough: .venv-test/installed
	@.venv-test/bin/pytest -n 2 --dist worksteal -m "thorough and not slow and not killed"

types: .venv-test/installed
	@mkdir -p build/elsewhere; root=$$PWD; \
	cd build/elsewhere; "$$root/.venv-test/bin/python" -m mypy --config-file "$$root/pyproject.toml" -p seals

examples: .venv-test/installed
	@.venv-test/bin/pytest -q -c pyproject.toml --rootdir . --doctest-modules --pyargs seals

# Another processor sums in another order: kernels of 2008 for the linear algebra (NumPy's and SciPy's),
# for NumPy's own loops (of all names only those that this NumPy knows and could use) and for PyTorch.
# Chosen are tests of make test that such a processor can fail: sums and decompositions in NumPy and SciPy
# (laws, hulls, batches against single robots, allocation, closed forms) and decisions near a threshold
# (the diagnosis). Left out are engines, which bring arithmetic of their own, and commands, readers, pages,
# pictures, learning and particles: about 2 minutes on two cores.
KERNELS = OPENBLAS_CORETYPE=Nehalem ATEN_CPU_CAPABILITY=default \
	NPY_DISABLE_CPU_FEATURES="$$(.venv-test/bin/python -c '$(DISPATCHED)')"
DISPATCHED = from numpy._core._multiarray_umath import __cpu_dispatch__ as names, __cpu_features__ as has; \
	print(*(n for n in names if has[n]))
KERNEL_TESTS = $(wildcard \
	$(foreach name,control_allocation control_axes control_batched control_parts diagnose drop_figures dynamics effects \
	frames hulls medium plan_motions rivals smoothing,tests/unit/test_$(name)*.py) \
	$(foreach name,added_mass boundary cable clearance determinism energy floating free_fall held hulls joint limbs \
	pendulum principal radiation terminal tumbling twin water_entry,tests/verification/test_$(name)*.py))
test-kernels: .venv-test/installed
	@$(KERNELS) .venv-test/bin/pytest -q -n 2 --dist worksteal $(KERNEL_TESTS)

# its pages are read from what is installed; make test, make thorough and make pages follow their commands.
# With --quiet, MkDocs counts no warnings, and --strict lets all of them pass
docs: .venv-test/installed
	@NO_MKDOCS_2_WARNING=1 .venv-test/bin/mkdocs build --strict
	@echo "build/site/index.html: the documentation; to search in it: python3 -m http.server -d build/site"

# SEALS_BROWSER=required, as the check of a change has it, is not content with leaving the browser's test out
browser:
	@[ "$${SEALS_BROWSER:-}" != required ] || command -v chromium >/dev/null || { \
		apt="$$([ "$$(id -u)" = 0 ] || echo sudo) apt-get -qq -o Dpkg::Use-Pty=0"; export DEBIAN_FRONTEND=noninteractive; \
		echo "Installing chromium for the test of the page"; \
		$$apt install -y chromium >/dev/null 2>&1 || { $$apt update; $$apt install -y chromium >/dev/null; }; }

# render draws the films; the measurements are those of OFFLINE, or are fetched
pages: .venv-test/pages
	@nice .venv-test/bin/python -m tests.docs.follow --slow --jobs $(PAGES_JOBS)

validate: .venv-test/installed
	@.venv-test/bin/pytest -m "slow or validation"

killed: .venv-test/installed
	@.venv-test/bin/pytest -m killed

# before a change that must not alter an answer, and after it, on one machine
golden: .venv-test/installed
	@.venv-test/bin/python -m benchmarks.golden $$([ -f build/golden.json ] && echo check || echo record) build/golden.json \
		$(addprefix --logs ,$(wildcard ../shared/hidden_effects/dev))

speed: .venv-test/installed
	@.venv-test/bin/python benchmarks/speed.py

fuzz: .venv-test/installed
	@.venv-test/bin/python benchmarks/fuzz.py

lint: .venv-test/installed
	@.venv-test/bin/ruff check .
	@.venv-test/bin/ruff format --check .

# the tests see what a user installs: the wheel, not the checkout
.venv-test/installed: .venv-test/tools $(SOURCES)
	@rm -rf build/lib build/bdist.* build/wheel; \
	.venv-test/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir build/wheel .; \
	.venv-test/$(PIP) --no-deps --force-reinstall build/wheel/aam_seals-*.whl; touch $@

.venv-test/tools: pyproject.toml setup.py $(LISTS)
	@python=$$($(FIND_PYTHON)); venv=.venv-test; \
	$$python -m venv $$venv; \
	$$venv/$(PIP) $(CONSTRAINED) --no-deps --retries 1 --timeout 20 --index-url $(TORCH_INDEX) torch 2>/dev/null || \
		echo 'No torch for the processor at $(TORCH_INDEX): taking the plain one, which may bring gigabytes of CUDA' >&2; \
	$$venv/$(PIP) $(CONSTRAINED) '.[dev,learn,agents,export,track,docs,sweep]'; touch $@

# pictures and films of the gallery; the rest of what pages need is there for the tests
.venv-test/pages: .venv-test/installed
	@venv=.venv-test; $$venv/$(PIP) $(CONSTRAINED) 'aam-seals[render]'; touch $@

clean:
	rm -rf build dist .venv .venv-test *.egg-info .mypy_cache .ruff_cache .pytest_cache
