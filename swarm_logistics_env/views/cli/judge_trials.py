"""`swarm-logistics judge TRIALS`: trials that somebody else recorded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option, echo

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.report.section import Texts, plural
from swarm_logistics_env.study.runs.notes import StoredStudy
from swarm_logistics_env.study.runs.recorded import RecordedStudy, notes_on
from swarm_logistics_env.study.runs.store import FILE_NAME
from swarm_logistics_env.study.trials import NO_FAULT_WORD, Column, Trial, Trials, read_trials
from swarm_logistics_env.study.verdicts.results import judge

from .study_commands import FullOption, JudgedOption
from .terminal import show_report, show_table
from .world_choice import Repeated

_LONGEST_VALUE = 12  # characters that show what a column holds
_MOST_ROWS = 20  # of conditions that are shown before the answer

TrialsArgument = Annotated[
    str,
    Argument(
        metavar="TRIALS",
        help="File of trials, one trial or delivery a row (CSV, .xlsx, .parquet, JSON of POGEMA or "
        "marl-eval, a Monitor's CSV), or a folder of them.",
    ),
]

ColumnOption = Annotated[
    Repeated,
    Option(
        "--column",
        metavar="WHAT=NAME",
        help="What a column of another name is, e.g. performance=boxes; or the number that all "
        "trials have, e.g. robots=8; may be repeated.",
    ),
]
WideOption = Annotated[
    str | None,
    Option(
        metavar="WHAT",
        help="What the columns of a wide table differ in: robots, fault, policy, trial "
        "(repetitions), or a parameter's name.",
    ),
]


def judge_trials_command(
    trials: TrialsArgument,
    out: JudgedOption = None,
    columns: ColumnOption = None,
    ignore: Annotated[
        Repeated, Option(metavar="NAME", help="Column to leave out; may be repeated.")
    ] = None,
    duration: Annotated[
        float | None,
        Option(
            help="Length of every trial in seconds, where no column says it; of a time to finish "
            "the limit at which trials were stopped.",
        ),
    ] = None,
    values: Annotated[
        Repeated,
        Option(
            "--value",
            metavar="COLUMN:CELL=NEW",
            help="A cell read as another, e.g. fault:kein=none; may be repeated.",
        ),
    ] = None,
    references: Annotated[
        Repeated,
        Option(
            "--reference",
            metavar="NAME=NUMBER",
            help="Value of a parameter that A is relative to; may be repeated.",
        ),
    ] = None,
    sum_over: Annotated[
        str | None,
        Option(
            metavar="NAME", help="Column that tells a trial's robots apart: one row of their sum."
        ),
    ] = None,
    decimal: Annotated[
        str | None, Option(metavar=".|,", help="Sign before decimals; as the cells show.")
    ] = None,
    thousands: Annotated[
        str | None, Option(metavar=".|,", help="Sign between thousands; none if not given.")
    ] = None,
    skip_missing: Annotated[
        bool, Option("--skip-missing", help="Leave out rows that lack a value, and count them.")
    ] = False,
    wide: WideOption = None,
    check: Annotated[
        bool, Option("--check", help="Show how the trials are read, and judge nothing.")
    ] = False,
    setup: Annotated[
        Repeated,
        Option(
            metavar="NAME=VALUE",
            help="A condition for the report to state; may be repeated.",
        ),
    ] = None,
    full: FullOption = False,
) -> None:
    """Judge recorded trials, of real robots or of another simulator.

    Their columns are robots, fault, faulty and delivered (or performance); where they apply seed,
    policy, onset and any parameter; or time, with a delivery a row. Without seeds the study is
    unpaired.
    """
    reading = {
        "columns": pairs("--column", columns),
        "ignore": ignore or (),
        "values": values or (),
        "reference": numbers("--reference", references),
        "sum_over": sum_over,
        "duration": duration,
        "decimal": decimal,
        "thousands": thousands,
        "skip_missing": skip_missing,
        "wide": wide,
    }
    judge_trials(trials, out, reading, setup=pairs("--setup", setup), only_check=check, full=full)


def judge_trials(
    source: str,
    out: Path | None,
    reading: Mapping[str, Any],
    *,
    setup: Mapping[str, str],
    only_check: bool,
    full: bool,
) -> None:
    """Judge the trials of a file or folder, keep them as a study, print the answer and report it.

    Args:
        out: directory of the study; None: results/judged/NAME, with a number where that holds
            other trials.
        reading: options of `read_trials`.
        setup: conditions for the report to state.
        only_check: whether to stop when it is shown how the trials were read.
    """
    trials = read_trials(source, **reading)
    _show_how_read(trials, source)
    for note in notes_on(trials):
        echo(note)
    echo()
    if only_check:
        return
    study = RecordedStudy.of(trials, setup)
    usual_directory = Path("results", "judged", Path(source).stem)
    directory = out or _free(usual_directory, study)
    if not _holds(directory, study):
        study.keep(directory)
    if directory not in (out, usual_directory):
        echo(f"{usual_directory} holds an earlier judgement, so this one is in {directory}")
    show_report(judge(study.plan, study.outcomes), directory, full=full)


def _show_how_read(trials: Trials, source: str) -> None:
    """Print what each column was taken for, and the conditions with their trials."""
    columns = [(column.name, column.use, _values_of(column)) for column in trials.columns]
    show_table(f"{source}: {trials.n_trials} trials", ("column", "read as", "values"), columns)
    conditions: Counter[tuple[Texts, int | None]] = Counter()
    for trial in trials.rows:
        conditions[_labels(trial), trial.n_robots] += trial.n_trials
    sizes_of: dict[Texts, list[tuple[int | None, int]]] = {}
    for (labels, n_robots), count in conditions.items():
        sizes_of.setdefault(labels, []).append((n_robots, count))
    rows = [(*labels, *_sizes_and_counts(sizes)) for labels, sizes in sizes_of.items()]
    left = len(rows) - _MOST_ROWS
    show_table(
        f"{len(conditions)} conditions",
        ("policy", "fault", "parameters", "N", "trials"),
        rows[:_MOST_ROWS],
        *([f"And {plural(left, 'row')} more."] if left > 0 else []),
    )


def _sizes_and_counts(sizes: list[tuple[int | None, int]]) -> tuple[str, str]:
    """Return the sizes of some conditions, and how many trials each has."""
    numbers = ", ".join(str(n_robots) for n_robots, _ in sizes if n_robots is not None)
    counts = sorted({count for _, count in sizes})
    if len(counts) > 1:
        return numbers, f"{counts[0]} to {counts[-1]}"
    if len(sizes) > 1:
        return numbers, f"{counts[0]} each"
    return numbers, str(counts[0])


def _values_of(column: Column) -> str:
    left = column.n_values - len(column.values)
    shown = ", ".join(value[:_LONGEST_VALUE] or "(empty)" for value in column.values)
    return f"{shown}, and {left} more" if left > 0 else shown


def _labels(trial: Trial) -> Texts:
    """Return policy, fault and parameters of a trial in words."""
    policy = f"{trial.policy}, {trial.table}" if trial.table else trial.policy
    fault = trial.fault if trial.fault == NO_FAULT_WORD else f"{trial.fault}, m = {trial.faulty}"
    onset = f" from {trial.onset:g} s" if trial.onset else ""
    parameters = ", ".join(f"{name} = {value:g}" for name, value in trial.parameters)
    return policy, fault + onset, parameters


def _holds(directory: Path, study: RecordedStudy) -> bool:
    """Return whether a directory holds this study already."""
    try:
        return StoredStudy.existing(directory).imported == study.plan.origin
    except StudyError:  # none, or none that reads
        return False


def _free(directory: Path, study: RecordedStudy) -> Path:
    """Return a directory that holds no other study: that one, or one with a number."""
    number = 1
    free = directory
    while (free / FILE_NAME).exists() and not _holds(free, study):
        number += 1
        free = directory.with_name(f"{directory.name}-{number}")
    return free


def pairs(option: str, texts: Repeated) -> dict[str, str]:
    """Return the names and values of an option that may be repeated.

    Raises:
        StudyError: one is not NAME=VALUE.
    """
    values = {}
    for text in texts or []:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise StudyError(f"{option} {text}: should be NAME=VALUE")
        values[name] = value
    return values


def numbers(option: str, texts: Repeated) -> dict[str, float]:
    """Return the names and numbers of an option that may be repeated.

    Raises:
        StudyError: one is not NAME=NUMBER.
    """
    values = {}
    for name, value in pairs(option, texts).items():
        try:
            values[name] = float(value)
        except ValueError:
            raise StudyError(f"{option} {name}={value}: should be NAME=NUMBER") from None
    return values
