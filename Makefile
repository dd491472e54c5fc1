# `make help` lists the targets. Everything runs in .venv, which the first call makes.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= $(firstword $(shell command -v python3.11 python3))
BIN := .venv/bin
NOTEBOOKS := $(wildcard book/[0-9]*.ipynb)
SITE := _build/html
BOOK_SOURCES := _config.yml _toc.yml environment.txt $(wildcard book/*.md book/*.py book/_static/*) \
	$(NOTEBOOKS) $(shell find rl_core book/data -type f -not -path '*/__pycache__/*' 2>/dev/null)

# One thread a process: the parallelism is over seeds, and results must not depend on core counts.
export OMP_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export SDL_VIDEODRIVER := dummy
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PYDEVD_DISABLE_FILE_VALIDATION := 1

.PHONY: help setup book test lint types unit pairing notebooks sync bench clean

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

book: $(SITE)/.complete ## execute the notebooks and build the site into _build/html
	@echo "The book is at file://$(CURDIR)/$(SITE)/index.html"

# Always from nothing: an incremental build passes over warnings in pages it does not read again.
$(SITE)/.complete: .venv/.installed $(BOOK_SOURCES)
	@rm -rf _build
	$(BIN)/jupyter-book build . --warningiserror --nitpick --keep-going
	@touch $@

test: lint types unit pairing notebooks ## everything that has to pass: style, types, tests, notebooks

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
	$(BIN)/pytest --nbmake --nbmake-timeout=5400 -o faulthandler_timeout=0 $(NOTEBOOKS)

sync: .venv/.installed ## write the .ipynb twins anew from the .py files
	$(BIN)/jupytext --update --to ipynb book/[0-9]*.py

bench: .venv/.benchmarks ## speed ratios against other libraries, measured now on this machine
	$(BIN)/python -m bench

.venv/.benchmarks: .venv/.installed bench/environment.txt
	@$(BIN)/pip install --quiet --requirement environment.txt --requirement bench/environment.txt
	@touch $@

clean: ## remove what was built and measured (keeps .venv)
	rm -rf _build results
