# `make demo` runs the main job, `make test` passes the tests; both set everything up first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: setup demo test explore coverage lint bench mutants firmware deb deb-test clean

setup: $(STAMP)

# uv when it is there, venv and pip when not.
$(STAMP): pyproject.toml
	@if command -v uv >/dev/null 2>&1; then \
	  uv venv --quiet --allow-existing --python $(PYTHON) $(VENV) && uv pip install --quiet --python $(BIN)/python -e '.[dev]'; \
	else \
	  $(PYTHON) -m venv $(VENV) && $(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'; \
	fi
	@touch $@

demo: setup
	rm -rf out/demo
	$(BIN)/mtm-hil demo --out out/demo

test: setup lint
	$(BIN)/pytest

# Property tests with other examples each time; SEED=... repeats a search.
SEED := $(or $(SEED),$(shell od -An -N4 -tu4 /dev/urandom | tr -d ' '))
explore: setup
	@echo 'to reproduce: make explore SEED=$(SEED)'
	@MTM_HYPOTHESIS=explore $(BIN)/pytest -m hypothesis --hypothesis-seed=$(SEED) tests \
	  || { echo 'to reproduce: make explore SEED=$(SEED)'; exit 1; }

# Lines and branches that no test reaches are printed; of what limits the robot and what both ends share there are none.
coverage: setup
	$(BIN)/pytest --cov --cov-report=term $(TESTS)
	$(BIN)/coverage report --fail-under=100 --include='mtm_onboard/protocol/*,mtm_onboard/runtime/guard.py'

lint: setup
	$(BIN)/ruff format --check --quiet .
	$(BIN)/ruff check --quiet .
	$(BIN)/mypy --no-error-summary

firmware: setup
	$(MAKE) -C firmware_shim

deb:
	$(PYTHON) packaging/build_deb.py

# As root, with debootstrap and a network: installs the package into a clean Debian and drives a simulated robot there.
deb-test: setup
	MTM_CLEAN_ROOT=1 $(BIN)/pytest tests/packaging/test_clean_root.py -s

mutants: setup
	$(BIN)/python -m tests.mutation $(if $(SECONDS),--seconds $(SECONDS))

bench: setup
	$(BIN)/pytest tests/benchmarks --benchmark-enable -s

clean:
	rm -rf $(VENV) out build dist firmware_shim/build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
