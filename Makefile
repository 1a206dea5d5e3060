PYTHON ?= python3
JOBS ?= 2

VENV := .venv
BIN := $(VENV)/bin
# The scripts of a virtual environment hold its absolute path: in a copied or moved checkout this name is another, and
# the environment is made anew.
STAMP := $(VENV)/installed-$(shell pwd | cksum | cut -d' ' -f1)

.DEFAULT_GOAL := help
.PHONY: help install check-python graphics browser demo test campaign lint docs bench clean

help: ## this list
	@echo "active-constraints; every target sets up $(VENV) first, once"
	@echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo
	@echo "  PYTHON=$(PYTHON)  the interpreter to set up with, 3.11 or newer"
	@echo "  JOBS=$(JOBS)          processes of the test run"

install: $(STAMP) ## make .venv and install the project into it, with what its development needs
	@:

# The stamp is written last, so an interrupted installation is made anew; an edited pyproject.toml only upgrades.
$(STAMP): pyproject.toml $(BIN)/python
	@if [ -e $@ ] && $(BIN)/python -m pip --version >/dev/null 2>&1; then \
	  rm -f $@; \
	  echo "pyproject.toml has changed: bringing $(VENV) up to date"; \
	else \
	  $(MAKE) --no-print-directory check-python || exit 1; \
	  echo "installing into $(VENV): about a minute, once"; \
	  "$(PYTHON)" -m venv --clear $(VENV) || exit 1; \
	fi; \
	$(BIN)/python -m pip install -qq --disable-pip-version-check --editable ".[dev]"
	@touch $@

# Nothing makes the interpreter alone; that it is missing or was replaced makes the stamp out of date.
$(BIN)/python: ;

check-python:
	@command -v "$(PYTHON)" >/dev/null || { \
	  echo "active-constraints needs Python 3.11 or newer; there is no $(PYTHON). Name yours: make PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "active-constraints needs Python 3.11 or newer; $(PYTHON) is $$("$(PYTHON)" --version 2>&1)." \
	    "Name another: make PYTHON=..." >&2; exit 1; }
	@"$(PYTHON)" -c 'import ensurepip' 2>/dev/null && exit 0; \
	if [ "$$(id -u)" = 0 ]; then as_root=; else as_root="sudo -n"; fi; \
	if command -v apt-get >/dev/null && $$as_root true 2>/dev/null; then \
	  echo "$(PYTHON) has no ensurepip: installing python3-venv"; \
	  $$as_root apt-get -qq update >&2; \
	  $$as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y python3-venv >&2; \
	fi; \
	"$(PYTHON)" -c 'import ensurepip' 2>/dev/null || { \
	  echo "$(PYTHON) has no ensurepip, so it cannot make $(VENV). On Debian or Ubuntu run:" \
	    "sudo apt-get install python3-venv" >&2; exit 1; }

# Where it cannot be had, the tests of pictures are skipped and say so.
graphics:
	@if ldconfig -p 2>/dev/null | grep -q -e libEGL.so.1 -e libOSMesa.so; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ]; then as_root=; else as_root="sudo -n"; fi; \
	if command -v apt-get >/dev/null && $$as_root true 2>/dev/null; then \
	  echo "no library renders off screen: installing libegl1 and libgl1"; \
	  $$as_root apt-get -qq update >&2 && $$as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y libegl1 libgl1 >&2 \
	    || echo "they could not be installed" >&2; \
	fi

# Where it cannot be had, the test that opens a report is skipped and says so.
browser:
	@if command -v chromium >/dev/null && command -v chromedriver >/dev/null; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ]; then as_root=; else as_root="sudo -n"; fi; \
	if command -v apt-get >/dev/null && $$as_root true 2>/dev/null; then \
	  echo "no browser to look at reports with: installing chromium and chromium-driver"; \
	  $$as_root apt-get -qq update >&2 && $$as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq install -y \
	    --no-install-recommends chromium chromium-driver >&2 || echo "they could not be installed" >&2; \
	fi

demo: install ## run S1-S5, print the violation table, write traces and figures to runs/demo
	$(BIN)/vfi run S1 S2 S3 S4 S5 --out runs/demo

test: install graphics browser ## the whole test run but the campaigns
	$(BIN)/python -m pytest -n $(JOBS)

campaign: install ## the full campaigns of the tests, minutes to hours
	$(BIN)/python -m pytest -n $(JOBS) -m campaign

lint: install ## ruff, its formatting, mypy --strict and the import contract
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: install ## build the documentation; a warning is an error
	$(BIN)/sphinx-build --quiet --nitpicky --fail-on-warning --keep-going docs docs/_build/html
	@echo "docs/_build/html/index.html"

bench: install ## time one S5 cycle beside the peers, and its growth: a table, and runs/bench/bench.json
	$(BIN)/python -m pip install -q --disable-pip-version-check --editable ".[dev,peers]"
	$(BIN)/python -m pytest tests/bench

clean: ## remove .venv, build products and caches; runs/ stays
	rm -rf $(VENV) build dist docs/_build htmlcov .coverage .coverage.* .benchmarks .hypothesis \
	  .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
