# `make demo` and `make test` set everything up by themselves, in .venv, and need nothing but Python with venv.

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
DOCS_READY := $(VENV)/.ready-for-docs
LOWEST := .venv-lowest
LOWEST_GUI := .venv-lowest-gui
# What the environment was made from: a change there makes it anew.
SOURCES := pyproject.toml
# Of the thousands of files that are installed a few hundred are ever imported: those are compiled then.
INSTALL := -m pip install --quiet --disable-pip-version-check --no-compile
# So compiled modules are kept even where the shell says not to: else each of the hundreds of processes compiles them anew.
unexport PYTHONDONTWRITEBYTECODE

# Looks for a Python that runs dForce; PYTHON=/path/to/python takes that one and no other.
PYTHON ?=
SUITS := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info < (3, 15))
define FIND_PYTHON
for python in $(or $(PYTHON),python3 python3.14 python3.13 python3.12 python3.11 python); do \
	"$$python" -c '$(SUITS)' >/dev/null 2>&1 && break; python=; \
done; \
if [ -z "$$python" ]; then \
	echo "dForce needs Python 3.11 to 3.14 with its venv module, and found none (on Debian and Ubuntu: apt install python3-venv)." >&2; \
	exit 1; \
fi
endef

.PHONY: demo check test browser lint docs validate screenshots test-lowest clean

demo: $(READY)
	$(BIN)/dforce run hysteresis -o approach.nc --plot approach.png --states

# Before each commit: lint, types, and the tests that are quick once kernels are compiled.
check: lint
	$(BIN)/pytest -n auto --dist loadfile --no-loadscope-reorder -q -m "not slow and not long" tests/unit tests/case tests/kernel tests/runs tests/sweeps tests/results tests/plot tests/forces tests/cli tests/gui $(ARGS)

# What .ci/run tests. ARGS goes to pytest: make test ARGS="tests/case -x". One process a core; a file's tests stay together,
# and share what they set up. Files are given out in the order of tests/conftest.py: else those of few tests come last, and
# those of the window, which take longest, are of few tests.
test: $(READY) browser
	$(BIN)/pytest -n auto --dist loadfile --no-loadscope-reorder $(ARGS)

# The tests of the window need a browser of Chromium's family. Debian's is installed where that may be done; where there is
# none, these tests say so and are left out.
browser: $(READY)
	@$(BIN)/python -c 'import sys; from dforce.gui.window.server import find_browser; sys.exit(find_browser() is None)' || \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		echo "Installing Debian's chromium for the tests of the window, once."; \
		{ apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends chromium; } >/dev/null 2>&1; \
	fi || true

lint: $(READY)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/python docs/_ext/typed_blocks.py

# The site, in docs/_build/html; it is made without a network, and read without one. Tests then read what was built.
docs: $(DOCS_READY) browser
	@rm -rf docs/_build/html  # a build that ended early leaves a file in the place of a folder
	$(BIN)/python -m sphinx --builder html --fresh-env --fail-on-warning --keep-going --quiet docs docs/_build/html
	@DFORCE_SITE=docs/_build/html $(BIN)/pytest -q tests/docs/test_built_pages.py
	@echo "The documentation is in docs/_build/html/index.html"

# Everything that dForce is held against, on a page; ARGS=--quick for the part that tests run. Then what `make test` leaves out.
validate: $(READY)
	$(BIN)/dforce validate -o validation.md $(ARGS)
	$(BIN)/pytest -n auto --dist loadfile --no-loadscope-reorder -q -m "long or site"

# The pictures of the window in the README and the documentation.
screenshots: $(READY) browser
	PYTHONPATH=tests $(BIN)/python docs/screenshots.py docs/_static

# The tests with the lowest versions that pyproject.toml allows; wheels of these exist for Python 3.11 and 3.12. What the
# window is made of asks for newer versions of what the rest takes: so each has its tests in an environment of its own.
# A warning that users see is an error here, too. One of deprecation is none: Python shows it to nobody but authors, and an
# old package beside a new one of another project warns of its own use of it.
SEEN_BY_USERS := -W error -W default::DeprecationWarning -W default::PendingDeprecationWarning
test-lowest: $(LOWEST)/.ready $(LOWEST_GUI)/.ready
	DFORCE_LOWEST=1 $(LOWEST)/bin/pytest $(SEEN_BY_USERS) -m "not long" --ignore tests/gui --ignore tests/browser $(ARGS)
	$(LOWEST_GUI)/bin/pytest $(SEEN_BY_USERS) tests/gui tests/browser

clean:
	rm -rf $(VENV) $(LOWEST) $(LOWEST_GUI) dist .pytest_cache .mypy_cache .ruff_cache .hypothesis approach.nc approach.png validation.md
	rm -rf docs/_build docs/forces docs/tutorials docs/paper docs/generated docs/reference/generated
	find src tests docs -name __pycache__ -type d -prune -exec rm -rf {} +

# A broken or half-made environment is made anew; a working one only gets what it lacks.
$(READY): $(SOURCES)
	@echo "Setting up $(VENV); this takes a minute or two, once."
	@$(BIN)/python -c 'import pip; $(SUITS)' >/dev/null 2>&1 || { $(FIND_PYTHON); "$$python" -m venv --clear $(VENV); }
	@$(BIN)/python $(INSTALL) --editable '.[dev]'
	@touch $@

$(DOCS_READY): $(READY)
	@$(BIN)/python $(INSTALL) --editable '.[docs]'
	@touch $@

$(LOWEST)/.ready: EXTRA := test
$(LOWEST_GUI)/.ready: EXTRA := dev
$(LOWEST)/.ready $(LOWEST_GUI)/.ready: $(SOURCES)
	@$(FIND_PYTHON); "$$python" -m venv --clear $(@D)
	$(@D)/bin/python $(INSTALL) uv
	$(@D)/bin/uv pip install --quiet --python $(@D)/bin/python --resolution lowest-direct --editable '.[$(EXTRA)]'
	@touch $@
