"""`swarm-logistics judge TRIALS.csv`: trials that somebody else recorded."""

from __future__ import annotations

from pathlib import Path

from typer import echo

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.questions.plan import Origin
from swarm_logistics_env.runs.notes import StoredStudy
from swarm_logistics_env.runs.recorded import import_results, origin_of
from swarm_logistics_env.runs.store import FILE_NAME
from swarm_logistics_env.spi import read_trials
from swarm_logistics_env.studies import Study

from .app import Repeated
from .terminal import show_report


def judge_trials(
    file: str,
    out: Path | None,
    *,
    columns: Repeated,
    ignore: Repeated,
    duration: float | None,
    decimal: str | None,
    setup: Repeated,
    full: bool,
) -> None:
    """Import the trials of a CSV file as a study, print the answer and write the report.

    Args:
        out: directory of the study; None: results/judged/NAME, with a number where that holds
            other trials.
        setup: conditions for the report to state, as NAME=VALUE.
    """
    conditions = _pairs("--setup", setup)
    trials = read_trials(
        file,
        columns=_pairs("--column", columns),
        ignore=ignore or (),
        duration=duration,
        decimal=decimal,
    )
    origin = origin_of(trials, conditions)
    usual_directory = Path("results", "judged", Path(file).stem)
    directory = out or _free(usual_directory, origin)
    if not _holds(directory, origin):
        import_results(trials, directory, conditions)
    if directory not in (out, usual_directory):
        echo(f"{usual_directory} holds an earlier judgement, so this one is in {directory}")
    echo("\n".join([f"{len(trials.rows)} runs in {file}", *origin.notes, ""]))
    show_report(Study.stored(directory).findings(), directory, full=full)


def _holds(directory: Path, origin: Origin) -> bool:
    """Return whether a directory holds the study of these trials already."""
    try:
        return StoredStudy.existing(directory).imported == origin
    except StudyError:  # none, or none that reads
        return False


def _free(directory: Path, origin: Origin) -> Path:
    """Return a directory that holds no other study: that one, or one with a number."""
    number = 1
    free = directory
    while (free / FILE_NAME).exists() and not _holds(free, origin):
        number += 1
        free = directory.with_name(f"{directory.name}-{number}")
    return free


def _pairs(option: str, texts: Repeated) -> dict[str, str]:
    pairs = {}
    for text in texts or []:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise StudyError(f"{option} {text}: should be NAME=VALUE")
        pairs[name] = value
    return pairs
