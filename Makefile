# Builds its own environment; needs Python 3.11 or newer with pip, make, and no root.
# Another Python: make demo PYTHON=python3.12

PYTHON ?= python3
VENV   ?= .venv

python  := $(VENV)/bin/python
plugins := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))
stamp   := $(VENV)/.installed

extra-mvreg-peers := [kiss]

.PHONY: help demo bench report lint check test test-all coverage docs include wheel clean

help: ## Say what there is
	@echo 'make TARGET; each builds $(VENV) first when it is missing'
	@sed -n 's/^\([a-z-]*\):[^#]*## /  \1\t/p' $(firstword $(MAKEFILE_LIST))

demo: $(stamp) ## Register the embedded figurine
	@echo '==> mvreg dataset=figurine'
	@$(python) -m mvreg dataset=figurine

bench: $(stamp) ## Measure methods, peers, growth and kernels; BENCH='methods --rounds 5' for a part
	@echo '==> bench$(if $(MVREG_DATA),, (MVREG_DATA is not set: those on real scans will fail))'
	@$(python) -m experiments.bench.run $(BENCH)

report: $(stamp) ## Tables and figures in experiments/results from what the experiments left in runs/
	@echo '==> report'
	@$(python) -m experiments.report.build

lint: $(stamp) ## Style and types: ruff and mypy
	@echo '==> style'
	@$(python) -m ruff check
	@$(python) -m ruff format --check
	@echo '==> types'
	@$(python) -m mypy

# The tiers are decided in tests/tiers.py. What a tier leaves out is said at its end.
check: lint ## Lint, then the unit and kernel tests: less than a minute
	@echo '==> check'
	@$(python) -m pytest -n 2 --tier check

test: lint ## Check, contracts and whole runs; with MVREG_DATA set also those on real scans
	@echo '==> tests$(if $(MVREG_DATA),, (MVREG_DATA is not set: those on real scans are skipped))'
	@$(python) -m pytest -n 2 --tier test

test-all: lint ## Everything: also the documents' commands, the peers and the long ones
	@echo '==> all tests$(if $(MVREG_DATA),, (MVREG_DATA is not set: those on real scans are skipped))'
	@$(python) -m pytest -n 2 --tier all

coverage: $(stamp) ## The tests of `make test` again, saying which lines of mvreg and its plugins ran
	@echo '==> coverage$(if $(MVREG_DATA),, (MVREG_DATA is not set: tests on real scans are skipped))'
	@$(python) -m pytest -n 2 --tier test --cov --cov-report=term:skip-covered

docs: include ## Build the site into site/, with warnings and broken links as errors
	@echo '==> site'
	@$(python) docs/sphinx/build.py

include: $(stamp) ## Put the code that the documents include into them again, and list what is public
	@$(python) tests/documents/include.py
	@$(python) tests/documents/api.py

wheel: $(stamp) ## Build what is published into dist, and try it in a new environment: some minutes
	@rm -rf dist
	@$(python) -m build --outdir dist .
	@$(foreach plugin,$(plugins),$(python) -m build --outdir dist $(plugin) &&) true
	@echo '==> a new environment'
	@$(python) tests/wheels/fresh.py dist

clean: ## Remove the environment and what tools left behind; keep runs
	rm -rf $(VENV) build dist site *.egg-info plugins/*/*.egg-info plugins/*/build
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis .coverage*

# Again whenever what is to be installed may have changed. Where Python comes without ensurepip, as
# on Debian, its own pip fills the environment.
kernels := $(wildcard mvreg/kernels/*.pyx mvreg/kernels/*.pxd)

$(stamp): pyproject.toml setup.py $(kernels) $(plugins:%=%/pyproject.toml)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mvreg needs Python 3.11 or newer; try: make PYTHON=python3.12" >&2; exit 1; }
	@command -v "$${CXX:-c++}" >/dev/null || \
	  { echo "mvreg compiles its kernels and needs a C++ compiler, as c++ or in CXX: g++ or clang" >&2; \
	    exit 1; }
	@echo '==> building $(VENV): a download of some hundred megabytes, once'
	@test -x $(python) || $(PYTHON) -m venv $(VENV) 2>/dev/null || \
	  { rm -rf $(VENV) && $(PYTHON) -m venv --without-pip $(VENV) && \
	    $(PYTHON) -m pip --python $(python) install --quiet pip; }
	@$(python) -m pip install --disable-pip-version-check -e '.[dev]' \
	  $(foreach plugin,$(plugins),-e './$(plugin)$(extra-$(notdir $(plugin)))')
	@touch $@
