# `make help` lists the targets. Everything runs in .venv, which the first call makes.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

# The Python of .venv, or else the newest installed one that can make it.
PYTHON ?= $(if $(wildcard .venv/bin/python),.venv/bin/python,$(shell for python in \
	python3.13 python3.12 python3.11 python3; do "$$python" -c 'import sys, venv, ensurepip; \
	sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null && echo "$$python" && break; done))
BIN := .venv/bin
# What executes anything does so apart from the reader's settings; what is up to date is not made again.
RUN := $(BIN)/python book/web/isolation.py
STAMP := $(RUN) python book/web/stamp.py
# The front page comes last.
NOTEBOOKS := $(wildcard $(patsubst %,%.ipynb,$(shell sed -nE 's/^ *- file: *//p; s/^root: *//p' _toc.yml | sed '1{h;d};$$G')))
CHAPTERS := $(wildcard book/[0-9]*.ipynb)
NBMAKE = $(RUN) pytest --nbmake --nbmake-timeout=5400 -o faulthandler_timeout=0 --durations=0
SITE := _build/html
# The setting the site was built with is part of the stamp's name: a preview is never taken for the book.
COMPLETE := $(SITE)/.complete-$(or $(SEEDS),30)-seeds
SOURCES := _config.yml _toc.yml environment.txt book rl_core

# `make book SEEDS=3` is a first look with fewer seeds; no other target takes the setting.
unexport SEEDS
ifneq ($(SEEDS),)
PROBLEM := $(shell SEEDS='$(SEEDS)' "$(PYTHON)" book/report/seeds.py 2>&1 | tail -n 1)
ifneq ($(PROBLEM),)
$(error $(PROBLEM))
endif
endif

export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help setup announce book chapter lab zip pdf picture test lint types unit pairing notebooks browser hostile \
	sync bench timing clean .venv/install .venv/jax

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: ## make .venv with the pinned environment and the package
	@test -n "$(PYTHON)" || { echo "Python 3.11, 3.12 or 3.13 with venv is needed and was not found;" \
		"say where it is: make PYTHON=/path/to/python"; exit 1; }
	@"$(PYTHON)" book/web/stamp.py .venv/.installed --in environment.txt --in pyproject.toml \
		--also "$$("$(PYTHON)" --version)" -- $(MAKE) --no-print-directory PYTHON="$(PYTHON)" .venv/install

# An environment that is there stays, with what was put into it by hand, unless its Python is another.
.venv/install:
	@echo "Setting up .venv with $$("$(PYTHON)" --version) (first time: a few minutes, mostly downloads)"
	@test "$$($(BIN)/python --version 2>&1)" = "$$("$(PYTHON)" --version)" || "$(PYTHON)" -m venv --clear .venv
	@$(BIN)/python -m pip install --quiet --requirement environment.txt
	@$(BIN)/python -m pip install --quiet --no-build-isolation --no-deps --editable .

# What is coming is said before the minutes that the environment takes.
announce:
	@test -e .venv/.installed || SEEDS=$(SEEDS) "$(PYTHON)" book/web/announce.py

book: announce setup ## execute the notebooks, build the site into _build/html (first look: make book SEEDS=3)
	@SEEDS=$(SEEDS) $(STAMP) $(COMPLETE) $(SOURCES:%=--in %) --also "$$($(BIN)/python --version)" \
		-- python book/web/build.py
	@echo "The $(if $(filter-out 30,$(SEEDS)),preview ($(SEEDS) seeds),book) is at file://$(CURDIR)/$(SITE)/index.html"

chapter: setup ## execute and build one chapter alone: make chapter N=3
	@test -n "$(N)" || { echo "which one? make chapter N=3"; exit 1; }
	@SEEDS=$(SEEDS) $(RUN) python book/web/build.py --only $(or $(notdir $(basename \
		$(filter book/0$(N)_% book/$(N)_%,$(NOTEBOOKS)))),$(error there is no chapter $(N)))

lab: setup ## open the chapters in JupyterLab, with the Python of .venv
	$(RUN) python -m jupyterlab --ServerApp.root_dir=book --ServerApp.port=0 $(LAB)

zip: book ## the site as one file, _build/book.zip, which opens without a network or a server
	@$(STAMP) _build/.zip --in $(COMPLETE) -- python -m zipfile -c _build/book.zip $(SITE)
	@echo "The site is in $(CURDIR)/_build/book.zip: unpack it, open html/index.html"

pdf: book ## print the book to one file, _build/book.pdf (needs Chromium)
	@$(STAMP) _build/.pdf --in $(COMPLETE) --in book/web/paper.py --in book/web/chromium.py -- \
		python book/web/paper.py $(SITE) _build/book.pdf
	@echo "The printed book is at file://$(CURDIR)/_build/book.pdf"

picture: book ## take the README's picture from the built front page (needs Chromium)
	$(RUN) python book/web/portrait.py $(SITE)/book/intro.html .github/readme.png

test: lint types unit pairing notebooks browser ## all that has to pass: style, types, tests, notebooks, pages

lint: setup ## style and format (ruff)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: setup ## types (mypy, strict)
	$(BIN)/mypy

unit: setup ## unit tests and the examples in the docstrings
	$(RUN) pytest --numprocesses=logical --dist=loadfile

pairing: setup ## each notebook says the same as its .py twin and holds no outputs
	$(RUN) pytest tests/pairing.py

# The chapters on all cores; then one after the other what reads the results of them all.
notebooks: setup ## every notebook at full scale (nbmake)
	$(RUN) bash -c 'cd book && python -m studies.everything'
	$(NBMAKE) --numprocesses=logical $(CHAPTERS)
	$(NBMAKE) $(filter-out $(CHAPTERS),$(NOTEBOOKS))

browser: book ## the built book: claims, links; in a headless Chromium pictures, mathematics, films, search
	$(RUN) pytest --numprocesses=logical --dist=worksteal tests/built_book.py tests/browser.py tests/interactive_browser.py

hostile: setup ## a small book built among hostile settings has the same pictures and claims
	$(RUN) pytest tests/hostile.py

sync: setup ## write the .ipynb twins anew from the .py files
	$(BIN)/jupytext --update --to ipynb $(NOTEBOOKS:.ipynb=.py)

bench: setup ## speed ratios against other libraries, measured now on this machine
	@"$(PYTHON)" book/web/stamp.py .venv/.benchmarks --in environment.txt --in bench/environment.txt -- \
		$(BIN)/python -m pip install --quiet --requirement environment.txt --requirement bench/environment.txt
	@"$(PYTHON)" book/web/stamp.py .venv/.jax --in bench/jax.txt --also "$$("$(PYTHON)" --version)" -- $(MAKE) --no-print-directory .venv/jax
	$(RUN) python -m bench

# A rival whose libraries do not go with ours.
.venv/jax:
	@"$(BIN)/python" -m venv --clear $@
	@$@/bin/python -m pip install --quiet --requirement bench/jax.txt

timing: setup ## what the book, the preview and the tests take on a clean clone (an hour or two; goes on where it was stopped)
	$(BIN)/python -m bench.whole

clean: ## remove what was built and measured (keeps .venv)
	rm -rf _build results
