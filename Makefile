# `make help` lists the targets. Everything runs in .venv, which the first call makes.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= $(firstword $(shell command -v python3.11 python3))
BIN := .venv/bin
# In the order in which they are run: the appendices and the front page read what the chapters wrote.
NOTEBOOKS := $(sort $(wildcard book/[0-9]*.ipynb)) $(sort $(wildcard book/a[0-9]*.ipynb)) book/intro.ipynb
SITE := _build/html
# The setting the site was built with is part of the stamp's name: a preview is never taken for the book.
STAMP := $(SITE)/.complete-$(or $(SEEDS),30)-seeds
BOOK_SOURCES := _config.yml _toc.yml environment.txt $(wildcard book/*.md book/*.py book/*/*.py book/_static/*) \
	$(NOTEBOOKS) $(shell find rl_core book/data -type f -not -path '*/__pycache__/*' 2>/dev/null)

# `make book SEEDS=3` is a first look with fewer seeds; no other target takes the setting.
unexport SEEDS
PREVIEW := $(if $(filter-out 30,$(SEEDS)),_build/preview)
ifneq ($(SEEDS),)
PROBLEM := $(shell SEEDS='$(SEEDS)' "$(PYTHON)" book/report/seeds.py 2>&1 | tail -n 1)
ifneq ($(PROBLEM),)
$(error $(PROBLEM))
endif
endif

# One thread a process: the parallelism is over seeds, and results must not depend on core counts.
export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export SDL_VIDEODRIVER := dummy
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PYDEVD_DISABLE_FILE_VALIDATION := 1

.PHONY: help setup book pdf picture test lint types unit pairing notebooks browser sync bench clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: .venv/.installed ## make .venv with the pinned environment and the package

.venv/.installed: environment.txt pyproject.toml
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' \
		|| { echo "Python 3.11 is needed, $(PYTHON) is another; say which: make PYTHON=/path/to/python3.11"; exit 1; }
	@echo "Setting up .venv (first time: a few minutes, mostly downloads)"
	@test -x $(BIN)/python || "$(PYTHON)" -m venv .venv
	@$(BIN)/pip install --quiet --requirement environment.txt
	@$(BIN)/pip install --quiet --no-build-isolation --no-deps --editable .
	@touch $@

book: $(STAMP) ## execute the notebooks, build the site into _build/html (first look: make book SEEDS=3)
	@echo "The $(if $(PREVIEW),preview ($(SEEDS) seeds),book) is at file://$(CURDIR)/$(SITE)/index.html"

# Always from nothing: an incremental build passes over warnings in pages it does not read again.
# A preview is built from a copy of the sources, so that the tables it writes stay out of results/;
# what it runs is kept in the one store, where the book finds it again.
$(STAMP): .venv/.installed $(BOOK_SOURCES)
	@rm -rf _build
ifneq ($(PREVIEW),)
	@mkdir -p results/store _build/preview/results
	@cp -r _config.yml _toc.yml book _build/preview
	@ln -s ../../../results/store _build/preview/results/store
endif
	SEEDS=$(SEEDS) $(BIN)/jupyter-book build $(or $(PREVIEW),.) --path-output . --warningiserror --nitpick --keep-going
	@touch $@

pdf: _build/book.pdf ## print the book to one file, _build/book.pdf (needs Chromium)
	@echo "The printed book is at file://$(CURDIR)/$<"

# The book once more on a single page, from what Sphinx kept of the pages of the site.
_build/book.pdf: $(STAMP)
	SEEDS=$(SEEDS) $(BIN)/jupyter-book build $(or $(PREVIEW),.) --path-output . --builder singlehtml
	@cp _build/singlehtml/book/intro.html _build/singlehtml/printed.html
	PYTHONPATH=book $(BIN)/python -m web.paper _build/singlehtml/printed.html $@

picture: $(STAMP) ## take the README's picture from the built front page (needs Chromium)
	PYTHONPATH=book $(BIN)/python -m web.portrait $(SITE)/book/intro.html .github/readme.png

test: lint types unit pairing notebooks browser ## all that has to pass: style, types, tests, notebooks, pages

lint: .venv/.installed ## style and format (ruff)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: .venv/.installed ## types (mypy, strict)
	$(BIN)/mypy

unit: .venv/.installed ## unit tests and the examples in the docstrings
	$(BIN)/pytest

pairing: .venv/.installed ## each notebook says the same as its .py twin and holds no outputs
	$(BIN)/pytest tests/pairing.py

notebooks: .venv/.installed ## every notebook at full scale (nbmake)
	$(BIN)/pytest --nbmake --nbmake-timeout=5400 -o faulthandler_timeout=0 --durations=0 $(NOTEBOOKS)

browser: $(STAMP) ## the built book: claims, links; in a headless Chromium pictures, mathematics, films, search
	$(BIN)/pytest tests/built_book.py tests/browser.py

sync: .venv/.installed ## write the .ipynb twins anew from the .py files
	$(BIN)/jupytext --update --to ipynb $(NOTEBOOKS:.ipynb=.py)

bench: .venv/.benchmarks ## speed ratios against other libraries, measured now on this machine
	$(BIN)/python -m bench

.venv/.benchmarks: .venv/.installed bench/environment.txt
	@$(BIN)/pip install --quiet --requirement environment.txt --requirement bench/environment.txt
	@touch $@

clean: ## remove what was built and measured (keeps .venv)
	rm -rf _build results
