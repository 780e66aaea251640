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
* A claim "cannot fail" if no P puts the indicator below the threshold that it is claimed to be
  above; A > 0 is one where a parameter at least doubles. It is not played and not counted.
* Order: three seeds in all cells, two more in those of up to 60 robots, then these two in those of
  100 and 150, which cost most. Where the time ends before, the table says so.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from research.fit_paper import LARGE, Constants, Tried, append, cell_name, play, read_tried
from research.play_paper_fit import (
    ENDS,
    PAGE,
    Means,
    by_set,
    means,
    published,
    samples,
    sets_that_fit,
)
from research.tables import ROOT, rewrite, table
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import NO_FAULT, Question, Setting
from swarm_logistics_env.study.report import drawing
from swarm_logistics_env.study.report.points import Point
from swarm_logistics_env.study.verdicts.reference import PAPER
from swarm_logistics_env.world.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

FIRST_SEED = 5_400_000  # nothing else uses the seeds from here to 5,402,999
SETS = 30
SEEDS = 5  # a cell
SEEDS_IN_ALL_CELLS = 3  # before any set has more
LOWER = 0.25  # share of the sets
UPPER = 0.75
FOLDER = ROOT / "docs" / "results" / "paper_fit"
PICTURE = ROOT / "docs" / "media" / "paper-fit-claims.png"
MILD = ("FM1", "FM2", "FM3")  # the modes whose R and FT are near 0, in the paper and here
WORDS = ("holds", "fails", "open")


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
    """Return whether any P >= 0 puts the indicator beyond the threshold, not claimed there."""
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
    remaining = range(SEEDS_IN_ALL_CELLS, SEEDS)
    for numbers, cells_to_play in ((first, cells), (remaining, small), (remaining, LARGE)):
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


def of_cells(cells: Means) -> Callable[[Setting], float]:
    """Return P of each setting by the cells; what is no cell is the base scenario again."""

    def p(setting: Setting) -> float:
        name = cell_name(setting)
        return cells[name if name in cells else cell_name(NO_FAULT)]

    return p


def claim_text(question: Question) -> str:
    """Return a claim as the results print it."""
    sign = ">" if PAPER.claims[question] else "≤"
    before = question.original
    after = question.changed
    is_of_fault = question.indicator in ("FT", "R")
    condition = str(after) if is_of_fault else f"{before} -> {after.value:g}"
    return f"{condition}: {question.indicator} {sign} {question.threshold:g}"


def limits(n_holding: int, n: int) -> tuple[float, float]:
    """Return the lower and the upper 95 % limit of a share of which n draws gave n_holding."""
    from scipy.stats import binomtest

    interval = binomtest(n_holding, n).proportion_ci(confidence_level=0.9)
    return float(interval.low), float(interval.high)


def word(n_holding: int, n: int) -> str:
    """Return what it says of a claim that it holds under so many of n sets."""
    low, high = limits(n_holding, n)
    if low > UPPER:
        return "holds"
    return "fails" if high < LOWER else "open"


@dataclass(frozen=True)
class Claim:
    """A claim of the paper, and its indicator under the sets.

    Attributes:
        of_sets: by means over the seeds of each set, shape (n_sets,); empty: it cannot fail.
        of_runs: of each seed of each set that delivered something before, shape (n_runs,).
    """

    question: Question
    of_sets: NDArray[np.float64]
    of_runs: NDArray[np.float64]

    def is_on_its_side(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return of each value whether it lies on the claimed side; the threshold is below."""
        is_above = values > self.question.threshold
        return is_above if PAPER.claims[self.question] else ~is_above

    @property
    def n_holding(self) -> int:
        """Under how many of the sets it holds."""
        return int(self.is_on_its_side(self.of_sets).sum())

    @property
    def share_of_runs(self) -> float:
        """In which share of the single runs it holds."""
        return float(self.is_on_its_side(self.of_runs).mean())

    @property
    def word(self) -> str:
        """What the sets say of it."""
        if not can_fail(self.question):
            return "cannot fail"
        return word(self.n_holding, len(self.of_sets))

    @property
    def row(self) -> tuple[str, ...]:
        """Its row in the page's table."""
        before = f"{estimate(self.question, published).value:z.2f}"
        if not can_fail(self.question):
            return claim_text(self.question), before, "", "", "", "", self.word
        n = len(self.of_sets)
        low, high = np.quantile(self.of_sets, ENDS)
        lower, upper = limits(self.n_holding, n)
        return (
            claim_text(self.question),
            before,
            f"{self.of_sets.mean():z.2f} ({low:z.2f} to {high:z.2f})",
            f"{self.n_holding} of {n}",
            f"{100 * lower:.0f} to {100 * upper:.0f} %",
            f"{100 * self.share_of_runs:.0f} %",
            self.word,
        )


def judged_claims(rows: Sequence[Tried]) -> list[Claim]:
    """Return the claims with what was played, in the order of the paper's text."""
    means_of_sets = [means(of_set) for of_set in by_set(rows)]
    by_seed: dict[int, dict[str, int]] = {}
    for row in rows:  # a seed's small and large cells may be two rows
        by_seed.setdefault(row.seed, {}).update(row.performance)

    def values(question: Question, cells: Sequence[Means]) -> NDArray[np.float64]:
        needed = {cell_name(s) for s in settings_of(question) if s in PAPER.cells}
        functions = [of_cells(p) for p in cells if needed <= p.keys()]
        return np.array([estimate(question, p).value for p in functions if p(question.original)])

    return [
        Claim(question, values(question, means_of_sets), values(question, list(by_seed.values())))
        if can_fail(question)
        else Claim(question, np.empty(0), np.empty(0))
        for question in questions()
    ]


def runs_a_cell(rows: Sequence[Tried]) -> tuple[int, int]:
    """Return the least and the largest number of runs of a cell that a set has."""
    names = list(map(cell_name, needed_cells()))
    numbers = [len(samples(of_set)[name]) for of_set in by_set(rows) for name in names]
    return min(numbers), max(numbers)


def block(rows: Sequence[Tried], claims: Sequence[Claim]) -> str:
    """Return the table of the page."""
    words = Counter(claim.word for claim in claims)
    least, most = runs_a_cell(rows)
    runs = f"{least}" if least == most else f"{least} to {most}"
    shares = [claim.share_of_runs for claim in claims if claim.question.changed.name in MILD]
    summary = (
        f"{len(by_set(rows))} sets, {runs} runs a cell. Of {len(claims)} claims "
        f"{words['holds']} hold, {words['fails']} fail, {words['open']} are open and "
        f"{words['cannot fail']} cannot fail. The {len(shares)} claims on FM1 to FM3 "
        f"each hold in {100 * min(shares):.0f} to {100 * max(shares):.0f} % of single runs."
    )
    head = (
        "claim of the paper",
        "paper",
        "mean of the sets (5 to 95 % of them)",
        "holds under",
        "limits of the share",
        "single runs",
        "",
    )
    return f"{summary}\n\n{table(head, [claim.row for claim in claims])}"


def draw(claims: Sequence[Claim], path: Path = PICTURE) -> None:
    """Draw the share of the sets under which each claim holds by means, with its limits."""
    shown = [claim for claim in claims if can_fail(claim.question)]
    rows = []
    for claim in shown:
        n = len(claim.of_sets)
        share = claim.n_holding / n, *limits(claim.n_holding, n)
        point = Point(claim.word, WORDS.index(claim.word), "", *share, decided=claim.word != "open")
        rows.append((claim_text(claim.question), [point]))

    def picture(canvas: Canvas) -> None:
        drawing.forest(canvas, {"share of the sets under which it holds by means": rows})
        (axes,) = canvas.axes
        for limit in (LOWER, UPPER):
            axes.axvline(limit, color=drawing.INK, linewidth=0.8, linestyle=":")
        drawing.add_legend(canvas, axes)

    note = (
        f"{len(shown[0].of_sets)} sets; bars: one-sided 95 % limits of the share; dotted: above "
        f"{UPPER:g} a claim holds, below {LOWER:g} it fails."
    )
    path.write_bytes(drawing.images(picture, 0.9 + 0.2 * len(shown), note).png)


def main(minutes: float = 60.0, folder: Path = FOLDER) -> None:
    """Play what is left until the time is up, then write the page's table and its picture."""
    end = time.monotonic() + 60.0 * minutes
    path = folder / "claims.csv"
    play_missing(path, drawn_sets(folder / "tried.csv"), lambda: time.monotonic() > end)
    rows = read_tried(path)
    claims = judged_claims(rows)
    draw(claims)
    rewrite(PAGE, {"claims": block(rows, claims)})


if __name__ == "__main__":
    typer.run(main)
