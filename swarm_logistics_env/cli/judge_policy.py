"""`swarm-logistics judge POLICY`: the score card of a policy."""

from __future__ import annotations

import os
from pathlib import Path

import typer


def names_policy(asked: str) -> bool:
    """Return whether the argument of `judge` is a policy, not a file of trials."""
    from swarm_logistics_env.policies import SUFFIXES

    suffix = Path(asked).suffix
    if suffix in (*SUFFIXES, ".py"):
        return True
    if Path(asked).is_file() or suffix.lower() in (".csv", ".tsv", ".txt"):
        return False
    return ":" in asked or not suffix


def judge_policy(
    asked: str, out: Path | None, processes: int | None, trust_code: bool, *, full: bool
) -> int:
    """Play the study `scorecard` with a policy; print its score card and write the report.

    Every run is kept at once, so that the same command goes on after an interruption.

    Args:
        asked: the policy, for `policies.load`.
        out: directory; None: results/scorecards/ and the policy's name.
        processes: number of worker processes; None: all cores.
        trust_code: whether to read a model of stable-baselines3, which executes code in it.
        full: whether to print the report of the study as well.

    Returns:
        The number of runs that failed.

    Raises:
        PolicyError, StudyError: the policy cannot be loaded, or the store cannot be used.
    """
    from swarm_logistics_env.policies import called, load
    from swarm_logistics_env.report.document import document
    from swarm_logistics_env.report.figures import slug
    from swarm_logistics_env.report.report_files import write_report
    from swarm_logistics_env.report.score_card import STUDY, card_section, score_card
    from swarm_logistics_env.studies.engines import engine_named

    from .study_commands import in_one_line, run_study, show_report, study_of
    from .terminal_tables import show

    load(asked, trust_code=trust_code)  # what is wrong with it is said before anything is written
    out = out or Path("results", "scorecards", slug(called(asked)))
    study = study_of(STUDY, out, None, [asked], trust_code)
    typer.echo(f"{study.plan()}, kept in {out}\n")
    count = processes or os.cpu_count() or 1
    tally = run_study(study, engine_named("process" if count > 1 else "local", count, None))
    results = study.findings()
    show(card_section(score_card(results)))
    if full:
        show_report(results, document(results), out, full=True)
    else:
        typer.echo(f"Written: {', '.join(map(str, write_report(results, out)))}")
    typer.echo(in_one_line(tally, f"{count} process{'es' if count > 1 else ''}"))
    return tally.failed
