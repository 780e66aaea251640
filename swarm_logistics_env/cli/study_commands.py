"""`swarm-logistics study ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import plain

if TYPE_CHECKING:
    from swarm_logistics_env.report.document import Document
    from swarm_logistics_env.studies import Study
    from swarm_logistics_env.studies.engines import Engine
    from swarm_logistics_env.studies.results import StudyResults
    from swarm_logistics_env.studies.runs import Shard
    from swarm_logistics_env.studies.study import Tally

StudyArgument = Annotated[
    str,
    typer.Argument(
        metavar="FILE|PRESET",
        # Literal, as to import the presets would slow every command.
        help="TOML file of a study, or a preset: paper, quick, resilience, scorecard.",
    ),
]
SeedsOption = Annotated[
    int | None,
    typer.Option(min=1, help="Number of seeds of every condition; the study's if not given."),
]
FirstSeedOption = Annotated[
    int | None,
    typer.Option(min=0, help="Smallest seed, the others follow it; the study's if not given."),
]
PolicyOption = Annotated[
    list[str] | None,
    typer.Option("--policy", help="Policy to judge (`policies` lists them); may be repeated."),
]
TrustCodeOption = Annotated[
    bool,
    typer.Option(
        "--trust-code", help="Let a study name its task and policies as package.mod:NAME."
    ),
]
ProcessesOption = Annotated[
    int | None, typer.Option(min=1, help="Worker processes; all cores if not given.")
]
FullOption = Annotated[
    bool, typer.Option("--full", help="Print every table, not the answer alone.")
]

study = typer.Typer(name="study", help="Judge a swarm by its indicators.", no_args_is_help=True)


@study.callback()
def group() -> None:
    """Judge a swarm by its indicators."""


@study.command("list")
def list_command() -> None:
    """List the studies that come with the package."""
    from swarm_logistics_env.studies import Study
    from swarm_logistics_env.studies.presets import PRESETS

    from .terminal_tables import show_table

    rows = []
    for name in PRESETS:
        plan = Study.preset(name).plan()
        asked = dict.fromkeys(table for _, table, _ in plan.cells)
        n_runs = len(plan.conditions) * len(plan.seeds)
        rows.append((name, str(len(plan.seeds)), str(n_runs), "; ".join(asked)))
    line = "`study plan NAME` says how long one takes; `study run NAME` plays it."
    show_table("Studies", ("name", "seeds", "runs", "tables"), rows, line)


@study.command("plan")
def plan_command(
    asked: StudyArgument,
    seeds: SeedsOption = None,
    first_seed: FirstSeedOption = None,
    policies: PolicyOption = None,
    trust_code: TrustCodeOption = False,
) -> None:
    """Print the conditions, shared ones once, and what they will take; nothing is run."""
    from swarm_logistics_env.studies.engines import expected_seconds

    from .terminal_tables import show_table

    plan = study_of(asked, None, seeds, policies, trust_code, first_seed=first_seed).plan()
    seconds = expected_seconds(plan)
    uses: dict[str, list[str]] = {}
    for _, table, arm in plan.cells:
        uses.setdefault(arm.condition.key, []).append(f"{table} ({arm.setting})")
    rows = (
        (condition.policy.label, str(condition.size), "; ".join(uses[condition.key]))
        for condition in plan.conditions
    )
    show_table("Conditions", ("policy", "N", "stands in"), rows)
    typer.echo(plan)
    typer.echo(f"On one process of this machine at most {duration(seconds)}")


@study.command("run")
def run_command(
    asked: StudyArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Directory of its store and report; results/NAME if not given."),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            "--seeds",
            "--most",
            min=1,
            help="Number of seeds of every condition; with --until-clear the most (200).",
        ),
    ] = None,
    until_clear: Annotated[
        bool,
        typer.Option(
            "--until-clear",
            help="Look at 20, 30, .. seeds, and play on only what is not decided yet.",
        ),
    ] = False,
    first_seed: FirstSeedOption = None,
    policies: PolicyOption = None,
    processes: ProcessesOption = None,
    engine: Annotated[
        str | None,
        typer.Option(help="local (this process), process, or ray; process if not given."),
    ] = None,
    address: Annotated[
        str | None,
        typer.Option(help="Of a Ray cluster, e.g. auto; one is started here if not given."),
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option(metavar="I/N", help="Play part I of N alone, kept in OUT/shard-I-of-N."),
    ] = None,
    full: FullOption = False,
    trust_code: TrustCodeOption = False,
) -> None:
    """Play the runs that are missing, then print the answer and write the report."""
    import os

    from swarm_logistics_env.studies.engines import engine_named
    from swarm_logistics_env.studies.runs import Shard
    from swarm_logistics_env.studies.specification import FIRST_LOOK
    from swarm_logistics_env.studies.until_clear import MOST_SEEDS

    part = Shard.parse(shard) if shard else None
    looks: dict[str, bool] = {}
    if until_clear:
        seeds = MOST_SEEDS if seeds is None else seeds
        if seeds <= FIRST_LOOK:
            raise StudyError(
                f"--most {seeds}: should be more than {FIRST_LOOK} seeds, where the first look is"
            )
        looks = {"until_clear": True}
    chosen = study_of(asked, out, seeds, policies, trust_code, first_seed=first_seed, **looks)
    out = out or Path("results", chosen.specification.name)
    chosen.out = out / part.directory if part else out
    engine = engine or ("ray" if address else "local" if processes == 1 else "process")
    player = engine_named(engine, processes, address)
    typer.echo(f"{chosen.plan()}\n")
    if warning := chosen.exploratory_because():
        typer.echo(f"{warning}\n")
    tally = run_study(chosen, player, part)
    if part is None:
        _show(chosen, full=full)
    else:
        typer.echo(
            f"When all {part.count} shards are done: swarm-logistics study merge "
            f"{out}/shard-*-of-{part.count} --out {out}"
        )
    players = {"local": "1 process", "ray": "Ray"}.get(
        engine, f"{processes or os.cpu_count() or 1} processes"
    )
    # The last line: where it is looked for after a report of many pages.
    typer.echo(in_one_line(tally, players))
    raise typer.Exit(1 if tally.failed else 0)


@study.command("report")
def report_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a study.")],
    full: FullOption = False,
    trust_code: TrustCodeOption = False,
) -> None:
    """Print the answer and write the report of a study again, from its store alone."""
    from swarm_logistics_env.studies import Study

    stored = Study.stored(directory, trust_code=trust_code)
    typer.echo(f"{stored.plan()}\n")
    _show(stored, full=full)


@study.command("export")
def export_command(
    directory: Annotated[Path, typer.Argument(help="Directory of a study.")],
    to: Annotated[Path, typer.Option(help="File to write, .csv.")],
) -> None:
    """Write every stored run as one row, sorted by key, without wall times."""
    from swarm_logistics_env.studies.store import Store, export

    with Store.existing(directory) as store:
        count, digest = export(store, to)
    typer.echo(f"{count} runs in {to}, SHA-256 {digest}")


@study.command("merge")
def merge_command(
    directories: Annotated[list[Path], typer.Argument(help="Directories of shards of a study.")],
    out: Annotated[Path, typer.Option(help="Directory of the merged study.")],
) -> None:
    """Make one store of those that shards or machines have filled."""
    from swarm_logistics_env.studies.metadata import merge

    typer.echo(f"{merge(directories, out)} runs in {out}")


def study_of(
    asked: str,
    out: Path | None,
    seeds: int | None,
    policies: list[str] | None,
    trust_code: bool = False,
    *,
    first_seed: int | None = None,
    **fields: object,
) -> Study:
    """Return the study of a file or a preset with the options and fields that are given.

    Raises:
        StudyError: there is no such file or preset, or it cannot be.
    """
    from swarm_logistics_env.studies import Study

    if seeds is not None:
        fields["seeds"] = seeds
    if first_seed is not None:
        fields["first_seed"] = first_seed
    if policies:
        fields["policies"] = tuple(policies)
        for name in policies:
            if name.endswith(".zip") and not trust_code:
                raise StudyError(
                    f"--policy {name}: reading a model of stable-baselines3 executes the code in "
                    "it: should be allowed by --trust-code"
                )
    if asked.endswith(".toml") or Path(asked).is_file():
        return Study.from_file(asked, out=out, trust_code=trust_code, **fields)
    return Study.preset(asked, out=out, **fields)


def duration(seconds: float) -> str:
    """Return a time in words, e.g. "2 h 10 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def run_study(asked: Study, engine: Engine, shard: Shard | None = None) -> Tally:
    """Run a study; Ctrl-C ends the command and says how to go on."""
    try:
        return asked.run(engine, shard=shard)
    except KeyboardInterrupt:
        done, total = asked.finished(shard)
        left = f"the other {total - done}"
        if asked.specification.until_clear:
            left += ", and with what later looks need"
        typer.echo(
            f"\nStopped. {done} of {total} runs are finished and kept in {asked.out}; the same "
            f"command goes on with {left}.",
            err=True,
        )
        raise typer.Exit(130) from None


def in_one_line(tally: Tally, players: str) -> str:
    """Return how many runs `players` have played, in which time."""
    rate = f", {tally.played / tally.seconds:.2f} episodes/s" if tally.played else ""
    error = plain(tally.error or "")
    why = f", the first with {error}; study export has each traceback" if error else ""
    return (
        f"{tally.played} runs played in {tally.seconds:.1f} s by {players}{rate}; {tally.kept} "
        f"were kept from before; {tally.failed} failed{why}"
    )


def show_report(
    results: StudyResults, whole: Document, out: Path | None, *, full: bool = False
) -> None:
    """Write a study's report into a directory, and print the answer; the tables too if `full`."""
    from swarm_logistics_env.report.report_files import (
        how_to_get_figures,
        missing_packages,
        write_report,
    )

    from .terminal_tables import show, show_digest

    for section in whole.summary if full else ():
        show(section)
    try:
        written = write_report(results, out, whole) if out else (None,)
    except StudyError:  # as where the disk is full: what was found is told all the same
        show_digest(whole.answer, None, whole=full)
        raise
    show_digest(whole.answer, written[0], whole=full)
    if out and (missing := missing_packages()):
        typer.echo(how_to_get_figures(missing))


def _show(asked: Study, *, full: bool) -> None:
    from swarm_logistics_env.report.document import document

    results = asked.findings()
    show_report(results, document(results), asked.out, full=full)
