# Everything happens in .venv, made by the first target that needs it: locked versions, checked by hash.
PYTHON ?= python3
JOBS ?= 2
MUTATIONS ?= 100000
SEED ?= 0
INSTANCES ?= 10000
COUNT ?= 300
THREE ?= 0.187.0
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --quiet --quiet --no-input --disable-pip-version-check
# what is compiled once is not compiled again in each process that a test starts
unexport PYTHONDONTWRITEBYTECODE
# one thread a test process: the matrices are small, and the processes share the cores
PYTEST = OMP_NUM_THREADS=1 $(BIN)/pytest -q -n $(JOBS)
LOCK = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
	--no-annotate --custom-compile-command "make lock" $(LOCKFLAGS) pyproject.toml --group build

.DEFAULT_GOAL := help
.PHONY: help demo test test-all test-long golden fuzz adversary bounds equilibria files parroblib bench lint types index robots readme catalog notebooks jupyter docs pictures lock three release setup setup-dev setup-all setup-browser clean
.DELETE_ON_ERROR:

help:  ## this list
	@awk -F ':.*## +' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' Makefile

demo: setup  ## derive the hidden robot of a Quattro of which legs 1 and 4 are observed
	@$(BIN)/hrsynth derive robots/quattro.urdf --observe 1,4

# a file's tests go to one process: what they share is derived once
test: setup-dev  ## the tests, without the slow ones
	@$(PYTEST) --dist loadfile -m "not slow and not long and not browser" tests studies

# the heavy ones stand beside each other: who has done its own takes from the other's
test-all: setup-all setup-browser  ## all tests but the longest (AFTER_TEST=1: those that `make test` left out)
	@$(PYTEST) --dist worksteal -m "$(if $(AFTER_TEST),(slow or browser) and )not long" tests studies

test-long: setup-all  ## the tests that are left: all members of each law, many instances; hours
	@$(PYTEST) -m long tests

fuzz: setup-dev  ## 100,000 mutations of robot files (MUTATIONS=, SEED=): each is read or refused
	@$(BIN)/python tests/description/foreign/fuzz.py --count $(MUTATIONS) --seed $(SEED)

golden: setup-all  ## compare the output of every command with the golden files (ONLY=TEXT: cases that contain it; an hour)
	@cd tests && OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 ../$(BIN)/python -m golden.run compare --only "$(ONLY)" --workers $(JOBS)

bounds: setup-dev  ## 10,000 random instances of every family of assembly modes (INSTANCES=10000; half an hour)
	@cd tests && OMP_NUM_THREADS=1 ../$(BIN)/python -m analysis.modes.bounds $(INSTANCES)

adversary: setup-dev  ## compare results for random robots with brute force (COUNT=300, SEED=0); an interrupted run continues
	@mkdir -p build && cd tests && OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 ../$(BIN)/python -m adversary.run \
		--count $(COUNT) --seed $(SEED) --workers $(JOBS) --log ../build/adversary.jsonl

lint: setup-dev  ## style, import order and format
	@$(BIN)/ruff check --quiet . && $(BIN)/ruff format --check --quiet . && echo "lint: no complaint"

types: setup-dev  ## type check
	@$(BIN)/mypy
	@$(BIN)/mypy --config-file tests/mypy.ini

index: setup  ## register all analyses for `import hrsynth` and the command line, from their declarations
	@$(BIN)/python -c "from hrsynth.index import write; write()"

robots: setup  ## regenerate robots/*.urdf from the families
	@$(BIN)/python -m hrsynth.families

readme: setup  ## regenerate the tables of robots/README.md, docs/pages and studies/
	@cd docs && ../$(BIN)/python -m tables
	@cd studies && PYTHONPATH=../docs ../$(BIN)/python -m parroblib.says

catalog: setup-all  ## build catalog/, or continue an interrupted build (JOBS= processes; hours)
	@$(BIN)/hrsynth catalog build --workers $(JOBS)

notebooks: setup-all  ## write notebooks/*.ipynb from their scripts, without outputs
	@$(BIN)/python docs/lessons.py

jupyter: setup-all  ## open the notebooks in Jupyter, which is fetched the first time
	@test -x $(BIN)/jupyter-lab || $(PIP) install jupyterlab
	@cd notebooks && ../$(BIN)/jupyter-lab

docs: setup-all  ## run the notebooks that changed and build the site in build/site
	@NO_MKDOCS_2_WARNING=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/mkdocs build --quiet --strict

equilibria: setup-dev  ## outcomes of 100 servo runs of each robot, checked against the lists, as tables in studies/equilibria (an hour; an interrupted run continues)
	@mkdir -p build && cd tests && OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 ../$(BIN)/python -m simulation.far 100 --random 57 \
		--log ../build/far.jsonl -o ../studies/equilibria/README.md

files: setup-dev  ## read robot files of others again (OTHERS=folder with clones of their repositories: studies/files)
	@HRSYNTH_OTHERS="$(abspath $(OTHERS))" $(PYTEST) tests/description/foreign/test_others.py

parroblib: setup-dev  ## compare published tables of robots with what is computed (TABLES=folder; an hour; an interrupted run continues)
	@test -d "$(TABLES)" || { echo "TABLES=FOLDER: a folder of published tables (studies/parroblib/README.md)" >&2; exit 2; }
	@mkdir -p build && cd studies && ../$(BIN)/python -m parroblib audit "$(abspath $(TABLES))" --sample 2200 -o ../build/parroblib.jsonl

bench: setup-all  ## run the benchmarks and write their table in benchmarks/ (some minutes)
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 $(BIN)/python benchmarks/table.py benchmarks/README.md

pictures: setup-all setup-browser  ## draw the figures in docs/pictures (some minutes)
	@$(BIN)/python docs/pictures.py

lock: setup-dev  ## resolve the dependencies again (LOCKFLAGS=--upgrade: to the newest versions)
	@$(LOCK) --output-file requirements/main.txt
	@$(LOCK) --group dev --constraint requirements/main.txt --output-file requirements/dev.txt
	@$(LOCK) --group dev --group browser --extra all --constraint requirements/dev.txt --output-file requirements/all.txt

three:  ## bundle three.js for the 3D pages again (needs npm)
	@mkdir -p build/three && cp docs/three.js build/three/ && cd build/three && npm install --silent three@$(THREE) esbuild && \
		npx esbuild three.js --bundle --minify --format=iife --global-name=THREE --target=es2020 --outfile=three.min.js
	@{ echo '/*!'; echo 'three.js $(THREE) with OrbitControls and TransformControls, bundled by `make three`.'; echo; \
		cat build/three/node_modules/three/LICENSE; echo '*/'; cat build/three/three.min.js; } > src/hrsynth/present/studio/page/three.min.js

release: setup-dev  ## set VERSION=0.3.0, the changelog's date and the citation, build and check dist/, commit, tag; nothing is uploaded
	@$(BIN)/python docs/release.py $(VERSION)

setup: $(VENV)/main.stamp  ## .venv with what hrsynth needs to run
	@:

setup-dev: $(VENV)/dev.stamp  ## the same, with the tools of development
	@:

setup-all: $(VENV)/all.stamp  ## the same, with every extra
	@:

setup-browser:  ## Chromium for the tests of pages, from Debian's packages where that is possible
	@command -v chromium > /dev/null || command -v chromium-browser > /dev/null || command -v google-chrome > /dev/null || \
		{ test "$$(id -u)" = 0 && command -v apt-get > /dev/null && apt-get -qq update && \
		DEBIAN_FRONTEND=noninteractive apt-get -qq install --no-install-recommends chromium fonts-dejavu-core > /dev/null; } || \
		echo "the tests of pages are left out: they need Chromium (on Debian: apt-get install chromium)" >&2

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
		{ echo "hrsynth needs Python 3.11 or newer, and PYTHON=$(PYTHON) is not: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV)

# all.txt holds all of dev.txt, and dev.txt all of main.txt: the stamps of the smaller ones are set with the larger
$(VENV)/%.stamp: requirements/%.txt pyproject.toml | $(BIN)/python
	@echo "setting up $(VENV) from requirements/$*.txt (once, a minute or two)" >&2
	@$(PIP) install --no-compile --require-hashes --requirement requirements/$*.txt
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@cd $(VENV) && touch $(STAMPS_$*)

STAMPS_main := main.stamp
STAMPS_dev := main.stamp dev.stamp
STAMPS_all := main.stamp dev.stamp all.stamp

clean:  ## remove .venv, builds and caches
	@rm -rf $(VENV) build dist src/*.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +
