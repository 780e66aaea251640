# Every target makes the virtual environment it needs, once. The system offers Python 3.11 or newer, git and make.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
SEEDS  ?= 20
OUT    ?= results/paper

DEV   := .venvs/dev
STUDY := .venvs/study
DOCS  := .venvs/docs

TORCHRL   := .venvs/torchrl
RLLIB     := .venvs/rllib
SUPERSUIT := .venvs/supersuit

.PHONY: help paper test check benchmark interop docs format clean

help:
	@echo "make paper SEEDS=20  run the study of the paper; tables and data in $(OUT)"
	@echo "make test            the gate: lint, types, tests with coverage"
	@echo "make check           lint and types only"
	@echo "make benchmark       cost of a control step beside the bare physics"
	@echo "make interop         TorchRL, RLlib, SuperSuit and a plain PPO loop on the environment; see interop/"
	@echo "make docs            the documentation site, site/index.html"
	@echo "make format          sort imports and format"
	@echo "make clean           remove environments, builds and caches, never results"

paper: $(STUDY)/installed
	$(STUDY)/bin/swarm-logistics study run paper --seeds $(SEEDS) --out $(OUT)

test: check
	$(DEV)/bin/python -m pytest --numprocesses=2 --dist=loadgroup --cov --cov-report=term

check: $(DEV)/installed
	$(DEV)/bin/ruff check .
	$(DEV)/bin/ruff format --check .
	$(DEV)/bin/mypy

benchmark: $(STUDY)/installed
	$(STUDY)/bin/python -m benchmarks

interop: $(TORCHRL)/installed $(RLLIB)/installed $(SUPERSUIT)/installed
	$(TORCHRL)/bin/python -m interop.torchrl_specs
	$(TORCHRL)/bin/python -m interop.plain_ppo
	$(SUPERSUIT)/bin/python -m interop.supersuit_wrappers
	$(RLLIB)/bin/python -m interop.rllib_ppo

# study: autodoc reads the package. -W: a warning is an error.
docs: $(DOCS)/installed
	$(DOCS)/bin/python docs/generate.py
	$(DOCS)/bin/python docs/generate_study_files.py
	$(DOCS)/bin/python -m sphinx --builder html --fail-on-warning --keep-going docs site

format: $(DEV)/installed
	$(DEV)/bin/ruff check --fix .
	$(DEV)/bin/ruff format .

clean:
	rm -rf .venvs build dist site *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .coverage .coverage.* htmlcov
	find . -name __pycache__ -not -path "./.venv/*" -prune -exec rm -rf {} +

$(DEV)/installed: EXTRAS := dev,docs,study,render,train
$(STUDY)/installed: EXTRAS := study
$(DOCS)/installed: EXTRAS := docs,study
$(TORCHRL)/installed: OTHERS := torch torchrl
$(RLLIB)/installed: OTHERS := torch "ray[rllib]"
$(SUPERSUIT)/installed: OTHERS := supersuit

# The stamp comes last: an installation that was cut short is taken up again. Editable, so that a change of source needs no new one.
.venvs/%/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venvs/$*
	.venvs/$*/bin/python -m pip install --constraint constraints.txt --editable ".$(EXTRAS:%=[%])" $(OTHERS)
	@touch $@
