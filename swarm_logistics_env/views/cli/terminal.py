"""Sections, tables and answers at a terminal, and Markdown elsewhere."""

from __future__ import annotations

import textwrap
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from shlex import quote

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from typer import echo

from swarm_logistics_env import spi
from swarm_logistics_env.core.records import plain
from swarm_logistics_env.study.report.answer import MOST_LINES, answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.drawing import PAGE_STYLE, FigureStyle
from swarm_logistics_env.study.report.for_a_paper import in_a_sentence
from swarm_logistics_env.study.report.section import NOTHING, Section, Texts, levels, number
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.report.write import (
    how_to_get_figures,
    section_markdown,
    write_document,
)
from swarm_logistics_env.study.runs.engines import Tally
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import POWER, Verdict

_PLAIN_WIDTH = 80  # of what is read by a program or kept in a file


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
    is_finished: bool = True,
    style: FigureStyle = PAGE_STYLE,
) -> None:
    """Print the answer of a study and a sentence for a paper, and write its report into `out`.

    Args:
        full: print every table, and a line a question.
        is_finished: whether all is played; else no sentence is for a paper.
        style: of the files of figures; those in the page have its own.
    """
    report = document(results)
    if full:
        for section in report.summary:
            show(section)
    # Printed first: the answer is shown even where no file can be written.
    console = Console()
    width = console.width if console.is_terminal else _PLAIN_WIDTH
    shown = answer(results, most=None) if full else report.answer
    text = terminal_answer(shown, width, None if full else MOST_LINES)
    echo("\n".join(map(plain, text.split("\n"))))
    echo(f"Report: {write_document(report, out, style)[0]}")
    if advice := how_to_get_figures():
        echo(advice)
    else:
        echo(f"Figure: {out / 'figures' / 'answer.svg'}")
        echo(f"Tables: {out / 'tables.tex'}")
    names_modes = any(verdict.after.kind == "fault" for verdict in results.verdicts)
    if names_modes and "FM1" in results.plan.specification.played.failure_modes:
        echo("Failure modes: swarm-logistics list faults")
    if is_finished and any(verdict.estimate for verdict in results.verdicts):
        say(f"For a paper: {plain(in_a_sentence(results, report.answer))}")


class AnswerSoFar:
    """Shows on standard error what is known of a study that runs until it is clear.

    P as soon as it has an interval, the whole answer after the first look, a line after the others.
    """

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._looked = False

    def show(self, results: StudyResults) -> None:
        """Show these results."""
        now = f"After {time.monotonic() - self._start:.0f} s"
        so_far = answer(results)
        verdicts = results.verdicts
        seeds = [verdict.estimate.n_seeds for verdict in verdicts if verdict.estimate]
        if not seeds:
            lines = f"{now}: {so_far.performance}"
        elif not self._looked:
            lines = f"{now}, a first look:\n{terminal_answer(so_far, _PLAIN_WIDTH, MOST_LINES)}\n"
            self._looked = True
        else:
            n_clear = sum(verdict.stopped_at is not None for verdict in verdicts)
            lines = f"{now}, {max(seeds)} seeds: {n_clear} of {len(verdicts)} questions are clear."
        echo("\n".join(map(plain, lines.split("\n"))), err=True)


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
