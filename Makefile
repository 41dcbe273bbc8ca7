# The only commands a newcomer needs: make demo, make test. `make check` is what CI runs.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
PLAIN  := $(VENV)/.installed-engines
NODE   := node_modules/.installed

.PHONY: demo test slow trial figures missions check lint types contract javascript generated docs drawings wheel clean

demo: $(PLAIN)
	@$(BIN)/marsupial demo --out demo

test: $(STAMP)
	$(BIN)/python -m pytest -n 3 -m "not slow"

# Long studies, and the tests of properties on examples drawn anew.
slow: $(STAMP)
	$(BIN)/python -m pytest -m slow
	$(BIN)/python -m pytest -n 3 -m hypothesis --hypothesis-profile drawn

# The HTTP service killed, given hostile planners and timed: some minutes. docs/benchmarks.md says what more there is.
trial: $(STAMP)
	$(BIN)/python -m benchmarks trial --quick

# The figures of README and docs, from kept results; `missions` carries out all commands behind them first: some hours.
figures: $(STAMP)
	$(BIN)/python -m benchmarks figures

missions: $(STAMP)
	$(BIN)/python -m benchmarks figures --missions

check: lint types contract javascript test

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

contract: $(STAMP)
	$(BIN)/lint-imports

# Format, lint and types of the page; only this needs npm.
javascript: $(NODE)
	npm run --silent check

# The OpenAPI document and what follows from it in the client; generate_api.py says which files.
generated: $(STAMP)
	$(BIN)/python generate_api.py

# The site, in site/docs/index.html, with the missions of its gallery; `drawings` are pictures in it.
docs: $(STAMP)
	$(BIN)/python -m sphinx --quiet --fail-on-warning -c docs . site
	$(BIN)/python docs/gallery.py site/docs/gallery

drawings: $(STAMP)
	$(BIN)/python docs/drawings.py

# With precompiled code for this operating system, architecture and Python; `python -m build` makes one without.
wheel: $(STAMP)
	HATCH_BUILD_HOOKS_ENABLE=true $(BIN)/python -m build --wheel

# $(call install,EXTRA,SIZE): the environment with an extra of pyproject.toml, and precompiled code.
define install
	@echo "installing $(2) into $(VENV), for a minute or two ..."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable ".[$(1)]"
	@$(BIN)/python -m marsupial.library.precompiling
endef

# What missions need, for `make demo`.
$(PLAIN): pyproject.toml
	$(call install,engines,0.7 GB)
	@touch $(PLAIN)

# All that development needs, what missions need included.
$(STAMP): pyproject.toml
	$(call install,dev,1.6 GB)
	@touch $(PLAIN) $(STAMP)

$(NODE): package-lock.json
	npm ci --silent --no-audit --no-fund
	@touch $(NODE)

clean:
	rm -rf $(VENV) node_modules build dist demo site jupyter_execute marsupial/precompiled .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
