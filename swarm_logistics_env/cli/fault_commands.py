"""`swarm-logistics attack`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import PresetOption, ScenarioOption, SetOption, scenario_of
from .study_commands import ProcessesOption

if TYPE_CHECKING:
    from swarm_logistics_env.fault_analysis.attack import AttackResult
    from swarm_logistics_env.warehouse import Fault

PolicyArgument = Annotated[
    str, typer.Argument(metavar="POLICY", help="Name, path of a file, or package.module:Class.")
]


def attack_command(
    policy: PolicyArgument,
    robots: Annotated[int, typer.Option(min=1, help="How many robots fail.")] = 2,
    modes: Annotated[
        list[str] | None,
        typer.Option("--mode", help="Mode to search; may be repeated."),
    ] = None,
    budget: Annotated[int, typer.Option(min=10, help="Runs of faults in the search.")] = 200,
    fresh: Annotated[int, typer.Option(min=3, help="Other seeds, for the estimates.")] = 30,
    seed: Annotated[int, typer.Option(help="Of the search's own choices.")] = 0,
    preset: PresetOption = "paper",
    file: ScenarioOption = None,
    changes: SetOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory; results/attack-POLICY if not given.")
    ] = None,
    processes: ProcessesOption = None,
) -> None:
    """Search for the fault that costs most: mode, role at the onset, time and duration.

    What it finds bounds the worst fault from one side: there may be worse ones.
    """
    from swarm_logistics_env.fault_analysis.attack import MODES, Attack, attack
    from swarm_logistics_env.studies.engines import engine_named

    asked = Attack(
        policy=policy,
        scenario=scenario_of(preset, file, changes),
        robots=robots,
        modes=tuple(modes) if modes else MODES,
        budget=budget,
        fresh=fresh,
        seed=seed,
    )
    engine = engine_named("local" if processes == 1 else "process", processes)
    place = out or Path("results") / f"attack-{Path(policy).stem}"
    try:
        found = attack(asked, engine, place)
    except KeyboardInterrupt:
        _stopped(place)
    _show_attack(found, policy, robots, fresh)


def _stopped(place: Path) -> None:
    typer.echo(
        f"\nStopped. What is finished is kept in {place}; the same command goes on.", err=True
    )
    raise typer.Exit(130) from None


def _show_attack(result: AttackResult, policy: str, robots: int, fresh: int) -> None:
    from swarm_logistics_env.fault_text import text_of
    from swarm_logistics_env.report.wording import bracketed

    from .terminal_tables import show_table

    rows = [
        (
            found.by,
            _in_words(found.fault),
            bracketed(found.robustness, 3),
            str(found.runs),
        )
        for found in result.found
    ]
    worst = min(result.found, key=lambda found: found.robustness.value)
    text = text_of(worst.fault)
    played = f" `run` and `watch` play it with --fault {shlex.quote(text)}." if text else ""
    capped = (
        "Capped: without a fault every item was delivered in a run or more, so R may be lower than "
        "shown. --set restock=true has no cap."
    )
    show_table(
        f"{policy}: worst faults found",
        ("found by", "fault", "R [95 %]", "runs"),
        rows,
        f"Worst fault of {robots} robots found: {_in_words(worst.fault)}, R = "
        f"{worst.robustness.value:.3f} on {fresh} seeds that no search has met.{played}",
        f"{result.tried} of {result.searched} faults were tried. What is found bounds "
        "the worst from one side: it proves no other fault harmless.",
        *([capped] if result.is_capped else ()),
    )


def _in_words(fault: Fault) -> str:
    who = "by the seed" if fault.role is None else fault.role.replace("_", " ")
    until = "" if fault.duration is None else f" for {fault.duration:g} s"
    return f"{fault.mode} of {fault.robots} ({who}) from {fault.onset:g} s{until}"
