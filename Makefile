# Every target makes the virtual environment it needs, once. The system offers Python 3.11 or newer, git and make.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
SEEDS  ?= 20
MINUTES ?= 10
OUT    ?= results/paper
VERSION = $(shell sed -n 's/^version = "\([^"]*\)".*/\1/p' pyproject.toml)

DEV   := .venvs/dev
STUDY := .venvs/study
DOCS  := .venvs/docs

FIT       := .venvs/fit
BENCHMARK := .venvs/benchmark
CANARY    := .venvs/canary

TORCHRL   := .venvs/torchrl
BENCHMARL := .venvs/benchmarl
RLLIB     := .venvs/rllib
SUPERSUIT := .venvs/supersuit
LEARNERS  := .venvs/learners
TASKS     := .venvs/tasks
DOTBOTS   := .venvs/dotbots
ROS       := .venvs/ros
JOSS      := .venvs/joss

PEERS     := mpe2 pogema rware vmas

INSTALLED := .venvs/lowest .venvs/newest

# The newest Python here, among commands or pyenv's, if it is newer than the gate's.
NEWER := .venvs/newer
NEWER_PYTHON = $(shell exec 2> /dev/null; gate=$$($(PYTHON) -c "import sys; print(sys.version_info[1])"); \
	for minor in 13 12; do for python in python3.$$minor $$(pyenv root)/versions/3.$$minor.*/bin/python; do \
		test $$minor -gt $$gate && $$python -c "" && echo $$python && exit; \
	done; done)

# Tests start many processes, and each would compile all sources again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help first-look paper paper-fit tune tables test daily interpreted quick lint check soak combined-faults mutants test-python on-newer-python canary test-lowest test-newest benchmark benchmark-peers interop interop-calls tasks dotbots ros bodies docs docs-versions docs-check dist joss release-check absolute-links format clean

help:
	@echo "make first-look      within three minutes, an environment, then P, S, R, FT and A of a shipped script with a report, results/first-look/report.html"
	@echo "make paper SEEDS=20  run the study of the paper; tables and data in $(OUT)"
	@echo "make paper-fit MINUTES=40  fit the constants of swarm-dt to the paper's tables, then confirm them for as long: results/paper_fit"
	@echo "make tune MINUTES=60   search the parameters of every script by one declared rule, then confirm them: results/tune"
	@echo "make tables          play the studies behind docs/results.md (26,000 runs, two hours of two cores; with the learners of make interop, if there), write its tables, the README's numbers and the scores of judge --benchmark"
	@echo "make test            the gate: lint, types, tests with coverage"
	@echo "make interpreted     once a day: kernels by the interpreter, which checks their indices"
	@echo "make quick           lint, types and the fastest tests, within a minute: for every commit"
	@echo "make check           lint and types only"
	@echo "make soak MINUTES=10 random worlds, every invariant at every step"
	@echo "make combined-faults  2,000 small worlds whose faults meet, against a slow reference"
	@echo "make mutants         faults made on purpose in all rooms, and the first test that catches each"
	@echo "make test-python     in two minutes, a run, golden trajectories and a study with the newest Python here and the newest dependencies"
	@echo "make test-lowest     the wheel with the oldest dependencies that it allows; test-newest: with the newest"
	@echo "make canary          golden trajectories, both ways of compiling, with the newest numba and the newest everything"
	@echo "make benchmark       cost of a control step beside the bare physics; results/benchmark"
	@echo "make benchmark-peers  speed of RWARE, POGEMA, MPE2 and VMAS beside this package, as ratios, into docs/comparison.md"
	@echo "make interop         four learners of other people's code, three trainings each (1.4 core-hours): results/interop"
	@echo "make interop-calls   TorchRL, BenchMARL, RLlib and SuperSuit, each for some steps; six learners with P before and after; see interop/"
	@echo "make tasks           the studies of RWARE, simple_spread and VMAS in examples/tasks, in small"
	@echo "make dotbots         bodies in the DotBots' simulator: the tests, and 20 DotBots for 20 s (half a minute, once pydotbot is installed)"
	@echo "make ros             a swarm over ROS 2: the tests, and 25 robots for 20 s with losses (a minute, once ROS 2 is installed)"
	@echo "make bodies          how far results carry to MuJoCo and to the DotBots' simulator: the tables of docs/bodies.md (two core-hours)"
	@echo "make docs            the documentation site, site/index.html"
	@echo "make daily           once a day: tests of whole commands, pages, examples and processes, which the gate leaves out"
	@echo "make docs-check      once a day: what every page prints, and every command of README and pages, with few seeds and steps"
	@echo "make dist            sdist and wheel in dist/, checked as the package index checks them, each installed and run"
	@echo "make joss            the paper for the Journal of Open Source Software as a PDF to read: build/paper.pdf"
	@echo "make release-check   all of a release that needs no account: the gate, both distributions, the site, the paper, what pages print"
	@echo "make format          sort imports and format"
	@echo "make clean           remove environments, builds and caches, never results"

first-look: SEEDS = 10
first-look: OUT = results/first-look
first-look: $(STUDY)/installed
	$(STUDY)/bin/swarm-logistics judge homing --seeds $(SEEDS) --out $(OUT)
	@echo
	@echo "Next: open $(OUT)/report.html; docs/indicators.md says how to read the verdicts."
	@echo "A controller of your own: cd examples && ../$(STUDY)/bin/swarm-logistics judge wanderer:Wanderer"

paper: $(STUDY)/installed
	$(STUDY)/bin/swarm-logistics study run paper --seeds $(SEEDS) --out $(OUT)

# Of one core, twice. It goes on from what lies in results/paper_fit.
paper-fit: $(FIT)/installed
	$(FIT)/bin/python -m research.fit_paper --minutes $(MINUTES)
	$(FIT)/bin/python -m research.play_paper_fit --minutes $(MINUTES)

tune: $(FIT)/installed
	$(FIT)/bin/python -m research.tune --minutes $(MINUTES)

tables: $(STUDY)/installed
	$(STUDY)/bin/python -m research.play_tables

# Kernels of steps and of networks are compiled beside mypy: two workers that begin with tests would compile each of them twice.
test: lint
	$(DEV)/bin/mypy & types=$$!; \
	$(DEV)/bin/python -m pytest -q tests/verification/test_trajectories.py -m "not daily" && \
	$(DEV)/bin/swarm-logistics run --policy ppo-robust --set duration=5 && wait $$types
	$(DEV)/bin/python -m pytest --numprocesses=2 --dist=loadgroup -m "not daily" --cov --cov-report= --ignore=tests/verification/test_trajectories.py
	$(DEV)/bin/python -m coverage report --fail-under=94

# Once a day: whole commands, pages, examples and processes, whose parts the gate tests.
daily: $(DEV)/installed
	$(DEV)/bin/python -m pytest --numprocesses=2 --dist=loadgroup -m daily

# Once a day: compiled kernels read beyond an array in silence, the interpreter raises an IndexError.
interpreted: $(DEV)/installed
	NUMBA_DISABLE_JIT=1 $(DEV)/bin/python -m pytest --numprocesses=2 -p verification.interpreted $(KERNELS) -m "not compiled"

# For every commit, within a minute: mypy runs beside the fastest tests, which interpret the kernels.
quick: lint
	$(DEV)/bin/mypy & types=$$!; \
	NUMBA_DISABLE_JIT=1 $(DEV)/bin/python -m pytest -q -p verification.interpreted $(QUICK) && wait $$types

QUICK := tests/world/warehouse/test_kinematics.py tests/study/questions/test_plan.py tests/verification/test_mutants.py \
	$(addprefix tests/spi/test_,indicators.py multiplicity.py) \
	$(addprefix tests/test_,imports.py sizes.py) $(addprefix tests/core/test_,records.py streams.py) tests/world/test_scenario.py

# What reaches every line of the kernels in seconds, without the compiler.
KERNELS := $(addprefix tests/world/warehouse/test_,thread_pool.py logistics.py sensing.py sensor_errors.py radio.py kinematics.py layout.py grid.py) \
	$(addprefix tests/policies/test_,swarm_dt.py routes.py homing.py crowd.py layers.py learned.py) tests/world/motion

lint: $(DEV)/installed
	$(DEV)/bin/ruff check .
	$(DEV)/bin/ruff format --check .

check: lint
	$(DEV)/bin/mypy

soak: $(DEV)/installed
	$(DEV)/bin/python -m verification.soak --minutes $(MINUTES)

combined-faults: $(DEV)/installed
	HYPOTHESIS_PROFILE=nightly $(DEV)/bin/python -m pytest tests/verification/test_combined_faults.py

mutants: $(DEV)/installed
	$(DEV)/bin/python -m verification.mutants

test-python:
	@$(if $(NEWER_PYTHON),$(MAKE) on-newer-python PYTHON=$(NEWER_PYTHON),echo "There is no Python newer than that of the gate ($(PYTHON)), so nothing was tested with one.")

on-newer-python: $(NEWER)/installed
	$(NEWER)/bin/swarm-logistics run --seed 0 --set duration=20
	$(NEWER)/bin/python -m pytest tests/verification/test_trajectories.py
	rm -rf results/newer
	$(NEWER)/bin/swarm-logistics study run quick --out results/newer

# What will come: the newest numba, whatever pyproject.toml allows, and the newest of everything else but torch.
# Both ways of compiling give the golden trajectories, or a change of numba is told before it reaches a user.
canary: $(CANARY)/installed
	$(CANARY)/bin/python -m pip install --constraint constraints.txt --upgrade --upgrade-strategy eager numba numpy pymunk pettingzoo gymnasium
	SWARM_LOGISTICS_KERNELS=plain $(CANARY)/bin/python -m verification.trajectories
	SWARM_LOGISTICS_KERNELS=fast $(CANARY)/bin/python -m verification.trajectories
	$(CANARY)/bin/swarm-logistics run --seed 0 --set duration=20

# Tests from a copy of the tree without the package, so that the one that is installed is tested.
test-lowest test-newest: test-%: .venvs/%/wheel
	rm -rf build/installed-$* && mkdir -p build/installed-$*
	git ls-files -z | grep -zv '^swarm_logistics_env/\|^policies$$\|^train$$' | xargs -0 tar -cf - | tar -xf - -C build/installed-$*
	cd build/installed-$* && $(CURDIR)/.venvs/$*/bin/python -m pytest --numprocesses=2 --dist=loadgroup

benchmark: $(BENCHMARK)/installed
	$(BENCHMARK)/bin/python -m benchmarks --out results/benchmark

# Each in an environment of its own, without this package, whose dependencies some of them exclude.
benchmark-peers: $(DEV)/installed $(PEERS:%=.venvs/peer-%/installed)
	$(DEV)/bin/python benchmarks/peers.py

# Each library in an environment of its own: what learns with it, and calls of its wrappers as tests.
interop: $(DEV)/installed $(TORCHRL)/installed $(BENCHMARL)/installed
	$(DEV)/bin/python -m interop

interop-calls: $(DEV)/installed $(TORCHRL)/installed $(BENCHMARL)/installed $(RLLIB)/installed $(SUPERSUIT)/installed $(LEARNERS)/installed
	for library in dev torchrl benchmarl rllib supersuit; do \
		.venvs/$$library/bin/python -m pytest -rs tests/test_interop.py || exit 1; \
	done
	$(LEARNERS)/bin/python -m interop.learners

tasks: $(TASKS)/installed
	$(TASKS)/bin/python -m pytest tests/study/tasks/test_examples.py

bodies: $(DEV)/installed
	$(DEV)/bin/python -m research.play_bodies

dotbots: $(DOTBOTS)/installed
	$(DOTBOTS)/bin/python -m pytest tests/world/bodies/test_pose_guard.py tests/world/bodies/test_dotbots_bodies.py
	$(DOTBOTS)/bin/swarm-logistics run --policy homing --preset dotbots --bodies dotbots --set duration=20

ros: $(ROS)/installed
	$(ROS)/bin/python -m pytest tests/robots/test_ros.py
	$(ROS)/bin/swarm-logistics ros homing --preset realistic --set duration=20 --loss 0.1 --delay 0.05

# study: the notebook is run; render: it films. A warning is an error.
docs: $(DOCS)/installed
	$(DOCS)/bin/python -m sphinx --builder html --fail-on-warning --keep-going docs site

# The site with those of former versions (tags v1.0.0 ..) below it, each as its own tree builds it; a release publishes it.
docs-versions: export SITE_VERSIONS = $(shell git tag --list "v[1-9]*" --sort=-version:refname | grep -vx "v$(VERSION)")
docs-versions: docs
	for tag in $(SITE_VERSIONS); do \
		rm -rf build/$$tag && git worktree add --force build/$$tag $$tag && $(MAKE) -C build/$$tag docs && \
		cp -r build/$$tag/site site/$$tag && git worktree remove --force build/$$tag || exit 1; \
	done

# A recorded run to look at: no page needs it.
docs/media/run.html: $(DEV)/installed
	$(DEV)/bin/swarm-logistics watch --fault FM4:3@60 --save $@ --until 150

# Once a day: what all pages print, of which `make test` leaves out the four that take longest; then what they do not show.
docs-check: $(DEV)/installed
	HYPOTHESIS_PROFILE=nightly $(DEV)/bin/python -m pytest tests/test_docs.py
	$(DEV)/bin/python -m docs.blocks --small

# Each distribution is installed in an environment of its own and plays an episode, away from this tree.
dist: $(DEV)/installed
	rm -rf dist build/dist
	$(DEV)/bin/python -m build
	$(DEV)/bin/python -m twine check --strict dist/*
	for file in dist/*; do \
		$(PYTHON) -m venv --clear build/dist && \
		build/dist/bin/python -m pip install --quiet $$file && \
		(cd build/dist && bin/swarm-logistics run --seed 0 --set duration=20) || exit 1; \
	done

# Programs that come as wheels: no LaTeX is needed.
joss: $(JOSS)/installed
	$(JOSS)/bin/python paper/build.py build/paper.pdf

# What is left to a person with the accounts stands in docs/releasing.md.
release-check: test dist docs joss
	$(DEV)/bin/python -m docs.api
	git diff --exit-code docs
	build/dist/bin/python -m pip install --quiet "$$(echo dist/*.whl)[study]"
	cd build/dist && bin/swarm-logistics judge homing --seeds 3 --all-seeds --set duration=60 --out judged
	@echo "Ready: dist/, site/ and build/paper.pdf. What is left: docs/releasing.md."

# For the page on the package index; it changes README.md and pyproject.toml, so only a release calls it, which knows the address.
absolute-links: $(DEV)/installed
	sed -i 's|^\[project.urls\]$$|&\nRepository = "$(REPOSITORY)"|' pyproject.toml
	$(DEV)/bin/python -m research.front_page

format: $(DEV)/installed
	$(DEV)/bin/ruff check --fix .
	$(DEV)/bin/ruff format .

clean:
	rm -rf .venvs build dist site *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis .coverage .coverage.* htmlcov
	find . -name __pycache__ -not -path "./.venv/*" -prune -exec rm -rf {} +

$(DEV)/installed: EXTRAS := dev,docs,study,render,train,watch,mujoco,onnx,tables
# The simulator of DotBots, without what pydotbot needs for other things: two of its dependencies install a package `tests`, which hides ours.
$(DEV)/installed: OTHERS := pyserial structlog toml "wasmtime>=49,<55"
$(DEV)/installed: BARE := "pydotbot>=0.33,<0.34" pydotbot-utils
$(STUDY)/installed: EXTRAS := study
$(NEWER)/installed: EXTRAS := study
$(NEWER)/installed: OTHERS := hypothesis pytest
$(DOCS)/installed: EXTRAS := docs,study,render
$(TORCHRL)/installed: OTHERS := hypothesis pytest torch torchrl
$(BENCHMARL)/installed: OTHERS := hypothesis pytest torch benchmarl
$(RLLIB)/installed: OTHERS := hypothesis pytest torch "ray[rllib]"
# shimmy: the Gymnasium door of VMAS asks for it.
$(TASKS)/installed: OTHERS := hypothesis pytest mpe2 rware shimmy vmas
$(SUPERSUIT)/installed: OTHERS := hypothesis pytest supersuit
# imitation asks for an older Gymnasium than the newest, and works with that.
$(LEARNERS)/installed: EXTRAS := train,minari
$(LEARNERS)/installed: OTHERS := cma sb3-contrib skrl
$(LEARNERS)/installed: BARE := imitation
$(DOTBOTS)/installed: EXTRAS := dotbots
$(DOTBOTS)/installed: OTHERS := hypothesis pytest
$(ROS)/installed: EXTRAS := ros
$(ROS)/installed: OTHERS := hypothesis pytest

# The wheel, with the oldest dependencies that pyproject.toml allows, or the newest that there are.
.venvs/lowest.txt: pyproject.toml verification/lowest.py
	@mkdir -p $(@D)
	$(PYTHON) verification/lowest.py study render watch > $@

.venvs/lowest/wheel: BOUNDS := --constraint .venvs/lowest.txt
.venvs/newest/wheel: BOUNDS := --upgrade --upgrade-strategy eager

.PHONY: $(INSTALLED:=/wheel)
$(INSTALLED:=/wheel): .venvs/lowest.txt
	$(PYTHON) -m venv $(@D)
	rm -rf build
	$(@D)/bin/python -m pip wheel --no-deps --wheel-dir build/wheels .
	$(@D)/bin/python -m pip uninstall --yes swarm-logistics-env
	$(@D)/bin/python -m pip install --constraint constraints.txt $(BOUNDS) \
		"$$(echo build/wheels/*.whl)[study,render,watch]" build hypothesis pytest pytest-xdist setuptools

$(FIT)/installed: EXTRAS := study
$(FIT)/installed: OTHERS := cma

$(BENCHMARK)/installed: EXTRAS := study,train

$(CANARY)/installed: EXTRAS := study,train
$(CANARY)/installed: OTHERS := hypothesis pytest

.venvs/peer-%/installed:
	$(PYTHON) -m venv .venvs/peer-$*
	.venvs/peer-$*/bin/python -m pip install --no-compile --constraint constraints.txt $*
	@touch $@

# Without the package, which the paper does not run.
$(JOSS)/installed:
	$(PYTHON) -m venv $(JOSS)
	$(JOSS)/bin/python -m pip install --no-compile "pypandoc-binary>=1.13" "typst>=0.11"
	@touch $@

# The stamp comes last: an installation that was cut short is taken up again. Editable, so that a change of source needs no new one.
# pip would compile what it installs on one core, which is half of its time. `|| true`: some packages hold templates that are no Python.
.venvs/%/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv .venvs/$*
	.venvs/$*/bin/python -m pip install --no-compile --constraint constraints.txt --editable ".$(EXTRAS:%=[%])" $(OTHERS)
	$(if $(BARE),.venvs/$*/bin/python -m pip install --no-compile --no-deps $(BARE))
	.venvs/$*/bin/python -m compileall -qq --workers 0 .venvs/$*/lib || true
	@touch $@
