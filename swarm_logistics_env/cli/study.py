"""`swarm-logistics study ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from swarm_logistics_env.studies import Study

study = typer.Typer(name="study", help="Judge a swarm by its indicators.", no_args_is_help=True)


@study.callback()
def group() -> None:
    """Judge a swarm by its indicators."""


@study.command("run")
def run_command(
    preset: Annotated[str, typer.Argument(help="Preset study: paper.")],
    out: Annotated[Path, typer.Option(help="Directory of its store and report.")],
    seeds: Annotated[int, typer.Option(min=1, help="Seeds 0, 1, ... of every condition.")] = 20,
    policies: Annotated[
        list[str] | None, typer.Option("--policy", help="Policy to judge; may be repeated.")
    ] = None,
    processes: Annotated[
        int | None, typer.Option(min=1, help="Worker processes; all cores if not given.")
    ] = None,
) -> None:
    """Play the runs that are missing, then print and write the report."""
    import os

    from swarm_logistics_env.studies import Study

    chosen = {"policies": tuple(policies)} if policies else {}
    asked = Study.preset(preset, out=out, seeds=seeds, **chosen)
    typer.echo(asked.plan())
    failed = _run(asked, processes or os.cpu_count() or 1)
    _show(asked)
    raise typer.Exit(1 if failed else 0)


@study.command("export")
def export_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a study.")],
    to: Annotated[Path, typer.Option(help="CSV file to write.")],
) -> None:
    """Write every stored run as one row, sorted by key, without wall times."""
    from swarm_logistics_env.studies.reporting.files import export_rows
    from swarm_logistics_env.studies.store import Store

    with Store.existing(directory) as store:
        typer.echo(f"{export_rows(store, to)} runs in {to}")


def _run(asked: Study, processes: int) -> int:
    """Run a study, tell how it went, and return how many runs failed."""
    try:
        tally = asked.run(processes=processes)
    except KeyboardInterrupt:
        typer.echo(
            f"\nStopped. Every finished run is kept in {asked.out}; the same command goes on.",
            err=True,
        )
        raise typer.Exit(130) from None
    rate = f", {tally.played / tally.seconds:.2f} episodes/s" if tally.played else ""
    typer.echo(
        f"{tally.played} runs played in {tally.seconds:.1f} s{rate}; {tally.kept} were kept from "
        f"before; {tally.failed} failed\n"
    )
    return tally.failed


def _show(asked: Study) -> None:
    from swarm_logistics_env.cli.tables import show
    from swarm_logistics_env.studies.reporting.sections import sections

    for section in sections(asked.findings()):
        show(section)
    typer.echo(f"Written: {', '.join(str(path) for path in asked.report())}")
