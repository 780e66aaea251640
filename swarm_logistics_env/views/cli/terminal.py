"""Sections, tables and answers at a terminal, and Markdown elsewhere."""

from __future__ import annotations

import math
import sys
import textwrap
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from shlex import quote
from shutil import which

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from typer import echo

from swarm_logistics_env import spi
from swarm_logistics_env.core.progress_bar import clock
from swarm_logistics_env.core.records import plain
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.drawing import PAGE_STYLE, FigureStyle
from swarm_logistics_env.study.report.section import NOTHING, Section, Texts, levels, number
from swarm_logistics_env.study.report.terminal_answer import PLAIN_WIDTH, terminal_answer
from swarm_logistics_env.study.report.write import (
    how_to_get_figures,
    section_markdown,
    write_document,
)
from swarm_logistics_env.study.runs.engines import Tally
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import POWER, Verdict

from .output import PROGRAM


def show(section: Section) -> None:
    """Print one section."""
    console = Console(highlight=False)
    if not console.is_terminal:
        # No wrapping: whatever reads this knows no terminal width.
        console.out(section_markdown(section), highlight=False)
        return
    console.rule(escape(plain(section.title)), align="left")
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in section.columns:
        # Folded where a terminal is narrow: a number that is cut is another number.
        table.add_column(escape(plain(column)), overflow="fold")
    for row in section.rows:
        table.add_row(*(escape(plain(cell)) for cell in row))
    console.print(table)
    for line in section.lines:
        console.print(escape(plain(line)))
    console.print()


def program() -> str:
    """Return what to type for this program: its name, or its path where no shell finds the name."""
    is_script = Path(sys.argv[0]).stem in (PROGRAM, f"{PROGRAM}-env")
    return quote(sys.argv[0]) if is_script and which(PROGRAM) is None else PROGRAM


def say(text: str, command: str = "") -> None:
    """Print text, folded between words at a terminal, and a command to paste on its own line."""
    console = Console()
    if console.is_terminal:
        text = textwrap.fill(text, console.width, break_long_words=False, break_on_hyphens=False)
        echo(f"{text}\n{command}" if command else text)
    else:
        echo(f"{text} {command}".rstrip())


def show_table(title: str, columns: Sequence[str], rows: Iterable[Texts], *lines: str) -> None:
    """Print a table, and lines of text below it."""
    show(Section(title, tuple(columns), tuple(rows), lines))


def show_report(
    results: StudyResults,
    out: Path,
    *,
    full: bool,
    style: FigureStyle = PAGE_STYLE,
) -> None:
    """Print the answer of a study, and write its report into `out`.

    Args:
        full: print every table before.
        style: of the files of figures; those in the page have its own.
    """
    report = document(results)
    if full:
        for section in report.summary:
            show(section)
    # Printed first: the answer is shown even where no file can be written.
    console = Console()
    width = console.width if console.is_terminal else PLAIN_WIDTH
    text = terminal_answer(report.answer, width, shortens=console.is_terminal)
    echo("\n".join(map(plain, text.split("\n"))))
    echo(f"Report: {write_document(report, out, style)[0]}")
    if advice := how_to_get_figures():
        echo(advice)
    else:
        echo(f"Figure: {out / 'figures' / 'answer.svg'}")
        echo(f"Tables for a paper: {out / 'tables.tex'}")


class AnswerSoFar:
    """Shows on standard error what is known of a study that runs until it is clear.

    P as soon as it has an interval, with the time that the rest takes; the whole answer after the
    first look, a line after the others.

    Args:
        n_before: how many runs were finished before.
    """

    def __init__(self, n_before: int = 0) -> None:
        self._start = time.monotonic()
        self._n_before = n_before
        self._looked = False

    def show(self, results: StudyResults) -> None:
        """Show these results."""
        seconds = time.monotonic() - self._start
        now = f"After {seconds:.0f} s"
        verdicts = results.verdicts
        seeds = [verdict.estimate.n_seeds for verdict in verdicts if verdict.estimate]
        if not seeds:
            n_played = len(results.outcomes) - self._n_before
            lines = f"{now}: {answer(results).head[0]}"
            if n_played > 0:
                lines += f"\n{what_the_rest_takes(results, seconds / n_played)}"
        elif not self._looked:
            lines = f"{now}, a first look:\n{terminal_answer(answer(results))}\n"
            self._looked = True
        else:
            n_clear = sum(verdict.stopped_at is not None for verdict in verdicts)
            n_ended = sum(bool(verdict.given_up) for verdict in verdicts)
            lines = (
                f"{now}, {max(seeds)} seeds: {n_clear} of {len(verdicts)} questions are clear, "
                f"{n_ended} are played no further."
            )
        # Not `echo`, which writes beside a progress bar that is drawn at the same time.
        sys.stderr.write("".join(f"{plain(line)}\n" for line in lines.split("\n")))


_SLOW = 1.0  # seconds a run, from which on it is told what fewer seeds would tell


def what_the_rest_takes(results: StudyResults, seconds_a_run: float) -> str:
    """Return how long a study until it is clear takes; of a slow one what fewer seeds would tell.

    Args:
        results: of one in which the seeds of the first look are played in some conditions.
        seconds_a_run: wall-clock time over runs, on all processes together [s].
    """
    first, *_, most = results.looks
    n_conditions = len(results.plan.cases)
    seconds = [
        seconds_a_run * max(0, n_conditions * n - len(results.outcomes)) for n in (first, most)
    ]
    text = (
        f"The first look comes in {clock(seconds[0])}, the whole takes at most {clock(seconds[1])} "
        "(h:mm:ss or m:ss)."
    )
    cells = [cell for cell in results.cells if cell.n_seeds >= first and cell.mean.value]
    if seconds_a_run < _SLOW or not cells:
        return text
    scatter = np.std(cells[0].by_seed, ddof=1) / cells[0].mean.value
    # Of a difference of two unpaired means, at 5 % of error and a power of 80 %.
    effects = [2.8 * math.sqrt(2.0 / n) * scatter for n in (first, most)]
    return (
        f"{text} A run takes {seconds_a_run:.1f} s: --seeds {first} ends after the first look and "
        f"tells effects of about {effects[0]:.2f}, {most} seeds those of about {effects[1]:.2f}."
    )


def show_power(study_name: str, results: StudyResults, effect: float | None) -> None:
    """Print the seeds that each comparison of a study needs for an effect, given or published."""
    n_seeds = len(results.plan.seeds)
    margin = results.plan.specification.margin
    runs = "seeds" if results.plan.paired else "trials a condition"
    columns = (
        "policy", "verdict on", "assumed effect", f"{runs} for {POWER:.0%} power",
        f"distance that {n_seeds} {runs} find", f"{runs} for equivalent at {margin:.0%}",
    )  # fmt: skip
    hint = f"For another effect: swarm-logistics study plan {quote(study_name)} --effect 0.2"
    rows = [
        _power(verdict, verdict.published if effect is None else effect)
        for verdict in results.verdicts
    ]
    level = levels(results.verdicts)
    lines = (hint,) if results.damage is None else (f"{results.damage}.", hint)
    show_table(f"Power, from {n_seeds} {runs}, of verdicts at {level}", columns, rows, *lines)


def _power(verdict: Verdict, effect: float | None) -> Texts:
    # Only the spread is taken from the runs, never the effect that they happened to show.
    comparison = verdict.compared
    estimate = verdict.estimate
    equivalence = verdict.equivalence
    seeds = verdict.problem or "no effect is named"
    if estimate is not None and effect is not None:
        seeds = spi.no_plan_because(estimate, effect) or str(
            spi.seeds_for_power(estimate, effect, POWER)
        )
    seeds_for_equivalence = NOTHING
    if equivalence is not None:
        seeds_for_equivalence = number(spi.seeds_for_equivalence(equivalence, POWER), 0)
    return (
        comparison.policy,
        f"{comparison.indicator} > {comparison.threshold:.3g}, {comparison.label}",
        number(effect),
        seeds,
        number(verdict.detectable),
        seeds_for_equivalence,
    )


def say_what_was_played(tally: Tally) -> None:
    """Print how many runs were played, in which time, what failed, and where it was given up."""
    rate = f", {tally.played / tally.seconds:.2f} episodes/s" if tally.played else ""
    first_error = f", the first with {plain(tally.error)}" if tally.error else ""
    for change in tally.changes:
        say(f"Runs that were stored before do not count: {change}.")
    say(
        f"{tally.played} runs played in {tally.seconds:.1f} s{rate}; {tally.kept} were kept from "
        f"before; {tally.failed} failed{first_error}"
    )
    if tally.gave_up:
        say(
            "Stopped, as nothing works: runs of every condition have failed and none succeeded, so "
            f"the other {tally.left} were not played. The first failed at {plain(tally.place)}. "
            "The same command plays all of them again."
        )
