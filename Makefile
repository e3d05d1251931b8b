# `make demo` runs the main job, `make test` passes the tests, `make test-all` also those that take long or need more than
# Python packages. Each sets up first what it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SITE_VENV := .venv-site
OLDEST := build/oldest
UV := build/uv/bin/uv
# Further arguments of every pytest.
PYTEST :=
# The build without CUDA where the index offers it under this number.
TORCH := torch==2.13.0

.PHONY: setup demo site test test-audit test-evidence test-hil test-others test-realtime test-slow test-all test-long test-oldest explore coverage lint peers bench mutants firmware \
  firmware-mutants deb deb-test dist constraints clean

# $(call install,folder,file): the packages that a file of constraints/ names, by hash, and the project itself.
install = $(PYTHON) -m venv $(1) && \
  $(1)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r constraints/$(2).txt && \
  $(1)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .

setup: $(VENV)/.dev

$(VENV)/.%: pyproject.toml constraints/%.txt
	@$(call install,$(VENV),$*)
	@touch $@

$(VENV)/.worlds: pyproject.toml constraints/worlds.txt
	@$(call install,$(VENV),worlds)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check $(TORCH)
	@touch $@

demo: $(VENV)/.hil
	rm -rf out/demo
	$(BIN)/mtm-hil demo --out out/demo

# Two parts beside each other, the longest first, and another as soon as one is done. What holds the wall clock's times has
# the machine to itself, after them.
test: setup lint
	@$(MAKE) --no-print-directory --jobs=2 test-audit test-evidence test-hil test-others
	@$(MAKE) --no-print-directory test-realtime

QUICK := -m "not slow and not long and not peer and not realtime"
EVIDENCE := tests/audit/decoding tests/audit/significance

test-evidence: setup
	$(BIN)/pytest $(QUICK) $(PYTEST) $(EVIDENCE)

test-audit: setup
	$(BIN)/pytest $(QUICK) $(PYTEST) $(EVIDENCE:%=--ignore=%) tests/audit

test-hil: setup
	$(BIN)/pytest $(QUICK) $(PYTEST) tests/hil

test-others: setup
	$(BIN)/pytest $(QUICK) $(PYTEST) --ignore=tests/audit --ignore=tests/hil tests

test-realtime: setup
	$(BIN)/pytest -m "realtime and not slow and not long and not peer" $(PYTEST) tests

# Whole films, tables and searches of ten seconds and more each; they need nothing that `make test` does not.
test-slow: setup
	$(BIN)/pytest -m "slow and not long and not peer" $(PYTEST)

# Everything: what `make test` runs, and then the rest.
test-all: test test-slow test-long test-oldest mutants firmware firmware-mutants peers site

# VMAS's worlds, the C compilers and the emulator, and the wheel in clean environments.
test-long: $(VENV)/.worlds
	$(BIN)/pytest -m long $(PYTEST)

# The lower end of each range of versions, whose warnings are not ours to mend; `make test` and `make test-long` have the upper one.
test-oldest: $(OLDEST)/.oldest
	$(OLDEST)/bin/python -m pytest -o filterwarnings= -m "not long and not peer" $(PYTEST) tests/audit tests/onboard

$(OLDEST)/.oldest: pyproject.toml constraints/oldest.txt
	@$(call install,$(OLDEST),oldest)
	@touch $@

# Property tests with other examples each time; SEED=... repeats a search.
SEED := $(or $(SEED),$(shell od -An -N4 -tu4 /dev/urandom | tr -d ' '))
explore: setup
	@echo 'to reproduce: make explore SEED=$(SEED)'
	@MTM_HYPOTHESIS=explore $(BIN)/pytest -m "hypothesis and not peer" --hypothesis-seed=$(SEED) tests \
	  || { echo 'to reproduce: make explore SEED=$(SEED)'; exit 1; }

# Lines and branches that no test reaches are printed; of what limits the robot and what both ends share there are none.
coverage: setup
	$(BIN)/pytest -m "not long and not peer" --cov --cov-report=term $(TESTS)
	$(BIN)/coverage report --fail-under=100 --include='mtm_onboard/protocol/*,mtm_onboard/runtime/guard.py'

lint: setup
	$(BIN)/ruff format --check --quiet .
	$(BIN)/ruff check --quiet .
	$(BIN)/mypy --no-error-summary

# The documents as a site in build/site; a broken link is an error.
site: $(SITE_VENV)/.installed
	NO_MKDOCS_2_WARNING=1 $(SITE_VENV)/bin/mkdocs build --strict

$(SITE_VENV)/.installed: docs/requirements.txt
	$(PYTHON) -m venv $(SITE_VENV)
	$(SITE_VENV)/bin/python -m pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	@touch $@

# Programs of others that ours meet, each at the version that tests/peers/requirements names. One that cannot be installed
# here is skipped with the reason, so this takes no $(PYTEST).
peers: setup
	$(BIN)/python tests/peers/install.py
	$(BIN)/pytest tests/peers -m peer -rs

firmware: setup
	$(MAKE) -C firmware_shim

firmware-mutants: setup
	$(MAKE) -C firmware_shim mutants

mutants: setup
	$(BIN)/python -m tests.mutation $(if $(SECONDS),--seconds $(SECONDS))

bench: setup
	$(BIN)/pytest tests/benchmarks --benchmark-enable -s

dist: setup
	rm -rf dist
	$(BIN)/python -m build
	$(BIN)/twine check --strict dist/*

deb: setup
	$(BIN)/python packaging/build_deb.py

# As root, with debootstrap and a network: installs the package into a clean Debian and drives a simulated robot there.
deb-test: setup
	MTM_CLEAN_ROOT=1 $(BIN)/pytest tests/packaging/test_clean_root.py -s

# Writes constraints/ anew: the newest versions within the ranges of pyproject.toml, and the oldest.
compile = $(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --upgrade \
  --custom-compile-command "make constraints" pyproject.toml --group build
constraints: $(UV)
	$(compile) --extra dev --extra worlds --extra parquet --overrides constraints/without_torch.in -o constraints/worlds.txt
	$(compile) --extra dev -c constraints/worlds.txt -o constraints/dev.txt
	$(compile) --extra hil -c constraints/worlds.txt -o constraints/hil.txt
	$(compile) --extra dev --resolution lowest-direct -o constraints/oldest.txt

$(UV):
	$(PYTHON) -m venv build/uv
	build/uv/bin/pip install --quiet --disable-pip-version-check uv

clean:
	rm -rf $(VENV) $(SITE_VENV) .peers out build dist firmware_shim/build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
