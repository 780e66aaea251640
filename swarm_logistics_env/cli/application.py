"""The application: errors in one sentence, options that commands share, tables at the terminal.

Sections are drawn at a terminal, and Markdown elsewhere.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shlex
import sys
import traceback
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from swarm_logistics_env import spi
from swarm_logistics_env.errors import FaultError, ScenarioError, SwarmLogisticsError
from swarm_logistics_env.policies import policy
from swarm_logistics_env.records import plain, read_table
from swarm_logistics_env.report.answer import MOST_LINES, Answer, answer, digest, in_a_sentence
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.section import NOTHING, WORDS, Section, number
from swarm_logistics_env.report.write import (
    how_to_get_figures,
    missing_packages,
    section_markdown,
    write_report,
)
from swarm_logistics_env.scenario import SCENARIO_PRESETS, Scenario
from swarm_logistics_env.spi.estimate import SIGNS
from swarm_logistics_env.studies.play import Tally
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import POWER, Verdict
from swarm_logistics_env.warehouse.fault_text import fault_of
from swarm_logistics_env.warehouse.faults import Fault

# A disk, a quota or a file that is full; a pipe that nobody reads.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EPIPE)


class Application(typer.Typer):
    """A Typer whose call ends the process with 0 (done), 2 (bad input) or 130 (Ctrl-C).

    A command ends otherwise by raising `typer.Exit(code)`.
    """

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Run the command line in `sys.argv`, or that in `args`."""
        code = self.run(kwargs.get("args"))
        try:
            sys.stdout.flush()
        except OSError:  # what is left in the buffer would be tried again
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(code)

    def run(self, arguments: list[str] | None = None) -> int:
        """Run a command line and return the exit code."""
        # A user's own policy lies in the folder in which the command is run. The folder comes last,
        # so that its modules hide no installed ones.
        if "" not in sys.path:
            sys.path.append("")
        try:
            command = typer.main.get_command(self)
            _show_help_well(command)
            # What made a file is recorded in it: the command line is the context's object.
            typed = sys.argv[1:] if arguments is None else arguments
            words = shlex.join(["swarm-logistics", *typed])
            code = command(arguments, standalone_mode=False, obj=words)
            sys.stdout.flush()
        except (KeyboardInterrupt, typer.Abort):
            return _complain("stopped", 130)
        except Exception as error:
            sentence = _sentence(error)
            if sentence is None:
                raise
            if not sentence:  # no command was named: the help has been printed
                return 2
            return _complain(sentence, 2)
        return code if isinstance(code, int) else 0


def _show_help_well(command: Any) -> None:
    """Escape the help of a command and of those below it: Rich reads `[px]` as a style."""
    command.help = escape(command.help or "")
    for parameter in command.get_params(typer.Context(command)):
        parameter.help = escape(getattr(parameter, "help", None) or "")
        if getattr(parameter, "is_flag", False):
            parameter.metavar = " "  # a flag takes no value, though Typer shows its type
    for below in getattr(command, "commands", {}).values():
        _show_help_well(below)


def _sentence(error: Exception) -> str | None:
    """Return what to tell the user, or None for a bug of ours, whose traceback should be seen."""
    # These are Typer's own errors of usage, whichever click they come from.
    format_message = getattr(error, "format_message", None)
    if format_message is not None:
        return str(format_message())
    if isinstance(error, SwarmLogisticsError | spi.IndicatorError):
        return str(error)
    if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
        return f"{str(error.filename)[:40]}...: {error.strerror}: should be a shorter path"
    if isinstance(error, OSError) and error.errno in _NO_ROOM:
        return f"cannot write {error.filename or 'the output'}: {error.strerror}"
    return _of_a_policy(error)


def _of_a_policy(error: Exception) -> str | None:
    """Return what a user's own policy raised, and where; None if the error came from elsewhere."""
    frames = traceback.extract_tb(error.__traceback__)
    calls = [number for number, frame in enumerate(frames) if frame.filename == policy.__file__]
    if not calls:
        return None
    beyond = frames[calls[-1] + 1 :]
    where = ""
    if beyond:
        its_file = beyond[0].filename
        if Path(its_file).is_relative_to(Path(policy.__file__).parents[1]):
            return None
        line = [frame.lineno for frame in beyond if frame.filename == its_file][-1]
        where = f" ({its_file}, line {line})"
    said = " ".join(str(error).split())
    return f"the policy raised {type(error).__name__}: {said}{where}"


def _complain(sentence: str, code: int) -> int:
    sys.stderr.write(f"swarm-logistics: {plain(sentence)}\n")  # it may repeat what was typed
    return code


PresetOption = Annotated[
    str, typer.Option(help=f"Scenario to start from: {', '.join(SCENARIO_PRESETS)}.")
]
ScenarioOption = Annotated[
    Path | None,
    typer.Option(
        "--scenario",
        metavar="FILE",
        help="TOML or JSON file of fields to change, as `list scenario --json` writes it.",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="FAULT",
        help="MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]], e.g. FM1:2@200; may be repeated.",
    ),
]
PolicyOption = Annotated[
    str,
    typer.Option(help="Name (`list policies`), path of a policy file, or package.module:Class."),
]
SeedOption = Annotated[int, typer.Option(help="Decides everything random.")]
TrustPolicyOption = Annotated[
    bool, typer.Option("--trust-code", help="Read a .zip policy, which executes the code in it.")
]


def scenario_of(preset: str, file: Path | None, changes: list[str] | None) -> Scenario:
    """Return the scenario that `--preset`, `--scenario` and `--set` describe.

    A file changes fields of the preset, and `--set` those of both.

    Raises:
        ScenarioError: no such preset, file or field, or a value that cannot be.
    """
    fields = {} if file is None else read_table(file, "file of --scenario", ScenarioError)
    preset = str(fields.pop("preset", preset))
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise ScenarioError(f"--set {change}: should be FIELD=VALUE")
        try:
            fields[name] = json.loads(value)
        except (json.JSONDecodeError, RecursionError):
            fields[name] = value
    return Scenario.preset(preset).replace(**fields)


def faults_of(texts: list[str] | None, scenario: Scenario) -> list[Fault]:
    """Return the faults that `--fault` describes, see `fault_text`.

    Raises:
        FaultError: a text does not read so, there is no such fault, or the episode ends before.
    """
    faults = [fault_of(text) for text in texts or []]
    for fault, text in zip(faults, texts or []):
        if fault.onset >= scenario.duration:
            raise FaultError(
                f"--fault {text}: should begin before the episode ends at {scenario.duration:g} s"
            )
    return faults


_PLAIN_WIDTH = 80  # of what is read by a program or kept in a file
_COLOURS = {word: SIGNS[verdict].colour for verdict, word in WORDS.items()}
_VERDICTS = re.compile(rf"(?<=  )({'|'.join(_COLOURS)})\b")


def show(section: Section) -> None:
    """Print one section."""
    console = Console(highlight=False)
    if not console.is_terminal:
        # No wrapping: whatever reads this knows no terminal width.
        console.out(section_markdown(section), highlight=False)
        return
    console.rule(escape(plain(section.title)), align="left")
    if section.columns:
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in section.columns:
            # Folded where a terminal is narrow: a number that is cut is another number.
            table.add_column(escape(plain(column)), overflow="fold")
        for row in section.rows:
            table.add_row(*(escape(plain(value)) for value in row))
        console.print(table)
    for line in section.lines:
        console.print(escape(plain(line)))
    console.print()


def show_table(
    title: str, columns: Sequence[str], rows: Iterable[tuple[str, ...]], *lines: str
) -> None:
    """Print a table, and lines of text below it."""
    show(Section(title, tuple(columns), tuple(rows), lines))


def show_answer(found: Answer, *, whole: bool = False) -> None:
    """Print the answer of a study on one screen, or with every line of it."""
    console = Console(highlight=False)
    width = console.width if console.is_terminal else _PLAIN_WIDTH
    lines = digest(found, width, None if whole else MOST_LINES).split("\n")
    shown = Text("\n".join(map(plain, lines)))
    for word in _VERDICTS.finditer(shown.plain):
        shown.stylize(_COLOURS[word[1]], *word.span())
    console.print(shown, soft_wrap=True)


def show_report(results: StudyResults, out: Path | None, *, full: bool = False) -> None:
    """Print the answer of a study and a sentence for a paper, and write its report into `out`.

    Args:
        full: print every table, and a line a question.
    """
    whole = document(results)
    for section in whole.summary if full else ():
        show(section)
    # Printed first: what was found is told even where no file can be written.
    show_answer(answer(results, most=None) if full else whole.answer, whole=full)
    if out:
        typer.echo(f"Report: {write_report(results, out, whole)[0]}")
        if missing := missing_packages():
            typer.echo(how_to_get_figures(missing))
        else:
            typer.echo(f"Figure: {out / 'figures' / 'answer.svg'}  Tables: {out / 'tables.tex'}")
        if not full and any(len(line.tests) > 1 for line in whole.answer.lines):
            again = f"swarm-logistics study report {shlex.quote(str(out))} --full"
            typer.echo(f"Each question on a line of its own: {again}")
    typer.echo(f"For a paper: {plain(in_a_sentence(results))}")


def show_power(asked: str, results: StudyResults, effect: float | None) -> None:
    """Print the seeds that each comparison of a study needs for an effect, given or published."""
    n_seeds, margin = len(results.plan.seeds), results.plan.specification.margin
    columns = (
        "policy", "verdict on", "assumed effect", f"seeds for {POWER:.0%} power",
        f"distance that {n_seeds} seeds find", f"seeds for equivalent at {margin:.0%}",
    )  # fmt: skip
    hint = f"For another effect: swarm-logistics study plan {shlex.quote(asked)} --effect 0.2"
    rows = [_power(test, test.published if effect is None else effect) for test in results.verdicts]
    show_table(f"Seeds needed, from {n_seeds} seeds", columns, rows, hint)


def _power(test: Verdict, effect: float | None) -> tuple[str, ...]:
    # Only the spread is taken from the runs, never the effect that they happened to show.
    compared, estimate, same = test.compared, test.estimate, test.equivalence
    seeds = test.problem or "no effect is named"
    if estimate is not None and effect is not None:
        seeds = spi.no_plan_because(estimate, effect) or str(
            spi.seeds_for_power(estimate, effect, POWER)
        )
    return (
        compared.policy,
        f"{compared.indicator} > {compared.threshold:.3g}, {compared.label}",
        number(effect),
        seeds,
        number(test.detectable),
        NOTHING if same is None else number(spi.seeds_for_equivalence(same, POWER), 0),
    )


def in_one_line(tally: Tally, players: str, out: Path) -> str:
    """Return how many runs `players` have played, in which time; they are kept in `out`."""
    rate = f", {tally.played / tally.seconds:.2f} episodes/s" if tally.played else ""
    error = plain(tally.error or "")
    place, to = shlex.quote(str(out)), shlex.quote(str(out / "runs.csv"))
    export = f"swarm-logistics study export {place} --to {to}"
    why = f", the first with {error}. Each traceback: {export}" if error else ""
    return (
        f"{tally.played} runs played in {tally.seconds:.1f} s by {players}{rate}; {tally.kept} "
        f"were kept from before; {tally.failed} failed{why}"
    )
