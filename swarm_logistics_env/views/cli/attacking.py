"""`swarm-logistics attack`: the fault that costs a policy most."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Exit, Option, echo

from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.report.section import bracketed, fixed, percent
from swarm_logistics_env.study.runs.engines import engine_named
from swarm_logistics_env.world.warehouse.faults import text_of

from .output import STOPPED
from .study_commands import ProcessesOption
from .terminal import show_table
from .world_choice import PresetOption, Repeated, ScenarioOption, SetOption, scenario_of

if TYPE_CHECKING:
    from swarm_logistics_env.study.attack import AttackResult


def attack_command(
    policy: Annotated[
        str,
        Argument(metavar="POLICY", help="Name, a file, module:Class, my.py:Class or c:my.c."),
    ],
    robots: Annotated[int, Option(min=1, help="How many robots fail.")] = 2,
    modes: Annotated[Repeated, Option("--mode", help="Mode to search; may be repeated.")] = None,
    budget: Annotated[int, Option(min=10, help="Runs of faults in the search.")] = 200,
    fresh: Annotated[int, Option(min=3, help="Other seeds, for the estimates.")] = 30,
    seed: Annotated[int, Option(min=0, help="Of the search's own choices.")] = 0,
    preset: PresetOption = None,
    file: ScenarioOption = None,
    changes: SetOption = None,
    out: Annotated[
        Path | None, Option(help="Directory; results/attack-POLICY if not given.")
    ] = None,
    processes: ProcessesOption = None,
) -> None:
    """Search for the fault that costs most.

    It tries modes, roles at the onset, times and durations. What it finds bounds the worst fault
    from one side: there may be worse ones.
    """
    from swarm_logistics_env.study.attack import MODES, Attack, attack

    search = Attack(
        policy=policy,
        scenario=scenario_of(preset, file, changes, policies=[PolicySpec.of(policy)]),
        robots=robots,
        modes=tuple(modes) if modes else MODES,
        budget=budget,
        fresh=fresh,
        seed=seed,
    )
    engine = engine_named("local" if processes == 1 else "process", processes)
    directory = out or Path("results") / f"attack-{Path(policy).stem}"
    try:
        result = attack(search, engine, directory)
    except KeyboardInterrupt:
        echo(
            f"\nStopped. What is finished is kept in {directory}; the same command goes on.",
            err=True,
        )
        raise Exit(STOPPED) from None
    _show_attack(result, policy, robots, fresh)


def _show_attack(result: AttackResult, policy: str, robots: int, fresh: int) -> None:
    rows = [
        (
            candidate.by,
            str(text_of(candidate.fault)),
            bracketed(candidate.robustness, 3),
            str(candidate.runs),
        )
        for candidate in result.found
    ]
    worst = min(result.found, key=lambda candidate: candidate.robustness.value)
    capped = (
        "Capped: without a fault every item was delivered in a run or more, so R may be lower than "
        "shown. --set restock=true has no cap."
    )
    show_table(
        f"{policy}: worst faults found",
        ("found by", "--fault", f"R [{percent(worst.robustness.confidence)}]", "runs"),
        rows,
        f"Worst fault of {robots} robots found: {text_of(worst.fault)}, R = "
        f"{fixed(worst.robustness.value, 3, [0.0])} on {fresh} seeds that the search has not met. "
        "`run` and `watch` play it with --fault.",
        f"{result.tried} of {result.searched} faults were tried. What is found bounds "
        "the worst from one side: it proves no other fault harmless.",
        *([capped] if result.is_capped else ()),
    )
