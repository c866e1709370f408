# Two commands matter: `make book` and `make test`. `make help` lists the rest.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
BUILT := _build/.complete
BENCH := .venv-bench
TOOLS := _build/dist-tools/bin
SOURCES := $(shell find book lib -type f -not -path '*/__pycache__/*' -not -name '.*' -not -path '*/thumbnails/*' 2>/dev/null) \
	_config.yml _toc.yml requirements.txt $(wildcard benchmarks/*.json) benchmarks/billion.py tools/execute_notebooks.py tools/executed.py tools/thumbnails.py \
	tools/book_pages.py tools/icons.js tools/search-order.js tools/downloads.py

# Everything runs in .venv, with .venv's settings: what the shell has of packages (ROS sets PYTHONPATH),
# start-up files, kernels named python3, styles and pip options stays outside.
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONOPTIMIZE PYTHONWARNINGS PYTHONSAFEPATH PYTHONINSPECT
unexport PYTHONDONTWRITEBYTECODE PYTHONPYCACHEPREFIX
unexport JUPYTER_CONFIG_PATH MATPLOTLIBRC MPLBACKEND PIP_USER PIP_TARGET PIP_PREFIX PIP_ROOT
export PYTHONNOUSERSITE := 1
export PYTHONUTF8 := 1
export JUPYTER_PREFER_ENV_PATH := 1
export JUPYTER_PATH := $(CURDIR)/$(VENV)/share/jupyter
export JUPYTER_DATA_DIR := $(JUPYTER_PATH)
export JUPYTER_CONFIG_DIR := $(CURDIR)/$(VENV)/etc/jupyter
export IPYTHONDIR := $(CURDIR)/$(VENV)/etc/ipython
export MPLCONFIGDIR := $(CURDIR)/$(VENV)/etc/matplotlib

# An environment is made anew if it lacks pip or a file that pip has listed (an installation that was
# stopped), or if it is another folder's: moved or copied.
MOVED := $(shell for f in $(VENV)/lib/python3*/site-packages/_*navfilters.pth; do \
	test ! -f "$$f" || grep -qxF "$$(pwd -P)/lib" "$$f" || echo moved; done)
ifneq ($(MOVED),)
.PHONY: $(VENV)/.book
endif
WHOLE := import sys, importlib.metadata as m, pip._internal.cli.main; sys.exit(not all(d.files and \
	all(f.locate().exists() for f in d.files if f.suffix != ".pyc") for d in m.distributions()))
define made
@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	{ echo 'Python 3.11 or newer is needed, as in: make book PYTHON=python3.13' >&2; exit 1; }
test -z "$(2)" && $(1)/bin/python -c '$(WHOLE)' >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(1)
endef

# Installs into an environment by uv where there is one, else by the environment's pip.
UV := $(shell command -v uv)
install = $(if $(UV),$(UV) pip install --python $(1)/bin/python --compile-bytecode,$(1)/bin/python -m pip install \
	--disable-pip-version-check) --quiet
locked = $(call install,$(1)) --require-hashes -r $(2)
ours = $(call install,$(1)) --no-deps --no-build-isolation -e .

.DEFAULT_GOAL := help
.PHONY: help book test unit longer coverage lint notebooks nbval elsewhere spread pages screens pdf dist serve bench fuzz faults shuffled mutants campaign lock clean

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## /\1  /p' $(MAKEFILE_LIST) | awk '{printf "  make %-10s", $$1; $$1 = ""; print}'

book: $(BUILT)  ## execute every notebook and build the HTML; warnings are errors
	@echo "The book is built. Open _build/html/index.html in a browser."

$(BUILT): $(SOURCES) $(VENV)/.book
	rm -rf _build/html _build/.jupyter_cache
	$(BIN)/python tools/execute_notebooks.py
	$(BIN)/python tools/thumbnails.py
	$(BIN)/jupyter-book build . --warningiserror --nitpick --keep-going
	$(BIN)/python tools/downloads.py _build/html
	@touch $@

test: lint coverage nbval elsewhere pages  ## everything: lint, types, unit tests, notebooks, rendered pages

unit: $(VENV)/.test  ## the unit and property tests that take a tenth of a second at most: five of six
	$(BIN)/pytest tests --ignore tests/book -n 2 --dist worksteal --quick

longer: $(VENV)/.test  ## measure which tests take longer, and are left to make coverage
	PYTHONPATH="$(CURDIR)/tools" $(BIN)/pytest tests --ignore tests/book -n 2 --dist worksteal -m "not slow" -p longer_tests

coverage: $(VENV)/.test  ## all unit tests, with branch coverage
	$(BIN)/pytest tests --ignore tests/book -n 2 --dist worksteal --cov --cov-report=term

lint: $(VENV)/.test  ## ruff over code and notebooks, mypy and the layers of imports over the library
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Two notebooks at a time, so that BLAS has one core each. Elsewhere it has its threads, which sleep when
# they wait: they would take the other notebook's core.
$(BUILT) elsewhere: export OPENBLAS_THREAD_TIMEOUT := 4
nbval: $(VENV)/.test  ## run every notebook and compare with its stored outputs
	OPENBLAS_NUM_THREADS=1 PYTHONPATH="$(CURDIR)/tools" $(BIN)/pytest book --nbval --nbval-current-env -n 2 --dist loadscope \
		--no-loadscope-reorder -p no:cacheprovider -p kernels -p longest_first -p keep_executed

elsewhere: $(VENV)/.test  ## the same without AVX-512, and with another BLAS kernel on one thread
	$(BIN)/python tools/nbval_elsewhere.py

spread: $(VENV)/.test  ## how far each claim moves with last bits and processors: an hour and a half
	$(BIN)/python tools/spread.py --store

pages: $(VENV)/.test $(BUILT)  ## the ledger, the stored notebooks, and the built pages in a browser
	$(BIN)/pytest tests/book -n 2 --dist loadscope -m "not alone"
	$(BIN)/pytest tests/book -m alone

notebooks: $(VENV)/.test  ## execute every notebook in place and refresh its stored outputs
	$(BIN)/python tools/refresh_notebooks.py
	$(BIN)/ruff format --quiet book

screens: $(VENV)/.test $(BUILT)  ## every page as a picture: wide and 390 px, light and dark
	$(BIN)/python tools/screens.py _build/html _build/screens

pdf: $(VENV)/.test $(BUILT)  ## the whole book as _build/book.pdf, printed by Chromium
	$(BIN)/python tools/pdf.py _build/html _build/book.pdf

dist: $(VENV)/.book  ## wheel and sdist in _build/dist, checked and installed into empty environments
	test -x $(TOOLS)/twine || $(PYTHON) -m venv --clear _build/dist-tools
	$(call locked,_build/dist-tools,requirements-dist.txt)
	$(BIN)/python tools/check_package.py $(TOOLS)

serve: $(VENV)/.book  ## the book at http://localhost:8000, built again when a page changes
	$(BIN)/python tools/serve.py

bench: $(BENCH)/.ready $(VENV)/.test  ## measure beside the peers and a C loop; store the results in benchmarks/
	env -u OPENBLAS_CORETYPE $(BENCH)/bin/python benchmarks/run.py
	env -u OPENBLAS_CORETYPE $(BENCH)/bin/python benchmarks/batches.py
	env -u OPENBLAS_CORETYPE $(BENCH)/bin/python benchmarks/growth.py
	env -u OPENBLAS_CORETYPE $(BIN)/python benchmarks/imaging.py
	env -u OPENBLAS_CORETYPE $(BIN)/python benchmarks/billion.py --measure

fuzz: $(VENV)/.test  ## a million damaged files for the readers; stopped, it goes on where it was
	nice $(BIN)/python tools/fuzz.py

faults: $(VENV)/.test  ## full disks, damaged checkpoints, two at once; runs killed and resumed; clusters that fail
	$(BIN)/pytest tests/runs/test_folder_faults.py tests/runs/test_checkpoints.py tests/runs/test_cluster.py
	nice $(BIN)/python tools/kills.py
	nice $(BIN)/python tools/cluster_faults.py

shuffled: $(VENV)/.test  ## the tests of make unit in a random order, which is told and can be repeated
	PYTHONPATH="$(CURDIR)/tools" $(BIN)/pytest tests --ignore tests/book -n 2 --quick -p shuffled

mutants: $(VENV)/.test  ## small faults put into the library one by one: how many do the unit tests see?
	nice $(BIN)/python tools/mutants.py

campaign: $(VENV)/.book  ## the closed loop at the paper's size; stopped, it goes on where it was
	$(BIN)/python -m navfilters.papers.pogorelsky2020 --campaign campaign

lock:  ## refresh the requirements.txt of book, tests, packages and bench from their .in lists
	test -x $(TOOLS)/uv || $(PYTHON) -m venv --clear _build/dist-tools
	$(call locked,_build/dist-tools,requirements-dist.txt)
	for list in requirements requirements-test requirements-dist benchmarks/requirements; do \
		$(TOOLS)/uv pip compile --quiet --upgrade --universal --generate-hashes \
			--python-version 3.11 $$list.in -o $$list.txt || exit 1; done

$(VENV)/.book: requirements.txt pyproject.toml
	$(call made,$(VENV),$(MOVED))
	$(call locked,$(VENV),requirements.txt)
	$(call ours,$(VENV))
	$(BIN)/python -c 'import matplotlib.font_manager'  # makes its cache
	@touch $@

$(VENV)/.test: requirements-test.txt $(VENV)/.book
	$(call locked,$(VENV),requirements-test.txt)
	@touch $@

$(BENCH)/.ready: benchmarks/requirements.txt pyproject.toml
	$(call made,$(BENCH))
	$(call locked,$(BENCH),benchmarks/requirements.txt)
	$(call ours,$(BENCH))
	@touch $@

clean:  ## remove what was built and the virtual environment
	rm -rf _build $(VENV) $(BENCH)
