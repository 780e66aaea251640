"""Play sets of constants that fit the paper's cells, and say which of its claims hold by means.

    python -m research.play_claims --minutes 60  # plays what is missing; a second call goes on

Declared before the first run:

* SETS of the sets that fit (`play_paper_fit.sets_that_fit`, in the order of tried.csv) are drawn
  by a keyed stream, whichever fits best. Each is played at SEEDS fresh seeds, all cells that a
  claim needs. Runs by which a set was chosen do not count, as they lie near the paper's values for
  that reason. All cells of a set have the same seeds; no two sets do, so that a share of the sets
  has binomial limits, which are not tied to the luck of five layouts.
* A claim holds under a set if the indicator of the means over its seeds lies on the claimed side.
* A claim holds (fails) if the one-sided 95 % Clopper-Pearson limit of the share of the sets lies
  above UPPER (below LOWER), else it is open. Of 30 sets these are 27 and more (3 and fewer). Above
  1/2 a claim would hold that one set in three denies; above .9 one unlucky mean would decide.
* A claim that no P >= 0 can contradict "cannot fail": it is not played and not counted.
* Order: three seeds in all cells, two more in those of up to 60 robots, then these two in those of
  100 and 150, which cost most. Where the time ends before, the table says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import typer

from research.fit_paper import LARGE, Constants, Tried, append, cell_name, play, read_tried
from research.play_paper_fit import sets_that_fit
from research.tables import ROOT
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import NO_FAULT, Question, Setting
from swarm_logistics_env.study.verdicts.reference import PAPER
from swarm_logistics_env.world.scenario import Scenario

FIRST_SEED = 5_400_000  # nothing else uses the seeds from here to 5,402,999
SETS = 30
SEEDS = 5  # a cell
SEEDS_IN_ALL_CELLS = 3  # before any set has more
LOWER = 0.25  # share of the sets
UPPER = 0.75
FOLDER = ROOT / "docs" / "results" / "paper_fit"
Means = Mapping[str, float]  # P by the name of the cell


class Job(NamedTuple):
    """One set of constants, a seed, and the cells to play at it."""

    constants: Constants
    seed: int
    cells: tuple[Setting, ...]


def questions() -> list[Question]:
    """Return the claims of the paper's text but those on FM3_send, another reading of FM3."""
    return [question for question in PAPER.claims if question.changed.name != "FM3_send"]


def settings_of(question: Question) -> tuple[Setting, ...]:
    """Return the settings of an indicator's performances, in the order of its definition."""
    removed = Setting("fault", "removed", question.changed.value)
    settings = (question.original, question.changed, removed)
    return settings[: len(DEFINITIONS[question.indicator].performances)]


def estimate(question: Question, p: Callable[[Setting], float]) -> Estimate:
    """Return an indicator by P of each setting."""
    definition = DEFINITIONS[question.indicator]
    before = question.original
    after = question.changed
    performances = {
        name: [p(setting)]
        for name, setting in zip(definition.performances, settings_of(question), strict=True)
    }
    n = int(before.value) if before.kind == "size" else Scenario().n_robots
    arguments = definition.arguments(Change(before.value, after.value, n))
    return definition.function(**performances, **arguments, threshold=question.threshold)


def can_fail(question: Question) -> bool:
    """Return whether any P >= 0 puts the indicator on the side that is not claimed."""
    is_never_below = "cannot_fail" in estimate(question, lambda _: 1.0).flags
    return not (PAPER.claims[question] and is_never_below)


def needed_cells() -> tuple[Setting, ...]:
    """Return the cells that the claims need which can fail, in the order of the paper's."""
    needed = {s for question in questions() if can_fail(question) for s in settings_of(question)}
    return tuple(setting for setting in PAPER.cells if setting in needed or setting == NO_FAULT)


def drawn_sets(tried: Path) -> list[Constants]:
    """Return the sets of constants that are played, drawn from those that fit."""
    fitting_sets = sets_that_fit(read_tried(tried))
    draws = generator(0, "sets of the claims")
    numbers = sorted(draws.choice(len(fitting_sets), SETS, replace=False))
    return [fitting_sets[number][0].constants for number in numbers]


def jobs(sets: Sequence[Constants]) -> Iterator[Job]:
    """Yield what is to play, in its order."""
    cells = needed_cells()
    small = tuple(setting for setting in cells if setting not in LARGE)
    first = range(SEEDS_IN_ALL_CELLS)
    others = range(SEEDS_IN_ALL_CELLS, SEEDS)
    for numbers, cells_to_play in ((first, cells), (others, small), (others, LARGE)):
        for number in numbers:
            for position, constants in enumerate(sets):
                yield Job(constants, FIRST_SEED + 100 * position + number, cells_to_play)


def play_missing(path: Path, sets: Sequence[Constants], is_over: Callable[[], bool]) -> None:
    """Play what the file lacks until the time is up; append each job at once."""
    played = {(row.seed, name) for row in read_tried(path) for name in row.performance}
    for job in jobs(sets):
        if is_over():
            return
        if all((job.seed, cell_name(setting)) in played for setting in job.cells):
            continue
        performance = play(job.cells, job.constants, job.seed)
        append(Tried("claims", 0, job.seed, job.constants, performance), path)


def main(minutes: float = 60.0, folder: Path = FOLDER) -> None:
    """Play what is left until the time is up."""
    end = time.monotonic() + 60.0 * minutes
    sets = drawn_sets(folder / "tried.csv")
    play_missing(folder / "claims.csv", sets, lambda: time.monotonic() > end)


if __name__ == "__main__":
    typer.run(main)
