"""`swarm-logistics study plan`: what a study takes, and the seeds that it needs."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.errors import StudyError

from .study_commands import (
    SYMBOLS,
    FirstSeedOption,
    PolicyOption,
    ProcessesOption,
    SeedsOption,
    TrustCodeOption,
    duration,
    study,
    study_of,
)

if TYPE_CHECKING:
    from swarm_logistics_env.studies.results import StudyResults


@study.command("plan")
def plan_command(
    asked: Annotated[
        str,
        typer.Argument(
            metavar="FILE|PRESET|DIR", help="A study; or the directory of one that was run."
        ),
    ],
    policies: PolicyOption = None,
    seeds: SeedsOption = None,
    first_seed: FirstSeedOption = None,
    effect: Annotated[
        float | None,
        typer.Option(help="Assumed true value of the indicator; the paper's if not given."),
    ] = None,
    power: Annotated[float, typer.Option(help="Wanted probability of a verdict.")] = 0.8,
    indicator: Annotated[
        str | None, typer.Option(help=f"Only {', '.join(SYMBOLS[:-1])} or {SYMBOLS[-1]}.")
    ] = None,
    at: Annotated[
        str, typer.Option(metavar="TEXT", help="Only comparisons whose name holds this.")
    ] = "",
    pilot: Annotated[
        int | None,
        typer.Option(min=2, help="Play so many seeds, which are not kept, for the seeds needed."),
    ] = None,
    processes: ProcessesOption = None,
    trust_code: TrustCodeOption = False,
) -> None:
    """Print the conditions and what they take; of a study that was run, the seeds that it needs."""
    from swarm_logistics_env.studies import Study
    from swarm_logistics_env.studies.play import expected_seconds

    from .terminal_tables import show_table

    if Path(asked).is_dir():
        if policies:
            raise StudyError("--policy is for a pilot: a study that was run has its own policies")
        results = Study.stored(asked, trust_code=trust_code).findings()
        _show_power(asked, results, effect, power, indicator, at)
        return
    chosen = study_of(
        asked, None, pilot or seeds, policies, trust_code, first_seed=first_seed,
        **({"until_clear": False} if pilot else {}),
    )  # fmt: skip
    if pilot:
        chosen.run(processes=processes or os.cpu_count() or 1)
        _show_power(asked, chosen.findings(), effect, power, indicator, at)
        return
    plan = chosen.plan()
    uses: dict[str, list[str]] = {}
    for _, table, arm in plan.cells:
        uses.setdefault(arm.case.key, []).append(f"{table} ({arm.setting})")
    rows = (
        (case.policy.title, str(case.scenario.n_robots), "; ".join(uses[case.key]))
        for case in plan.cases
    )
    show_table("Conditions", ("policy", "N", "stands in"), rows)
    typer.echo(plan)
    typer.echo(f"On one process of this machine at most {duration(expected_seconds(plan))}")


def _show_power(
    asked: str,
    results: StudyResults,
    effect: float | None,
    power: float,
    indicator: str | None,
    at: str,
) -> None:
    from swarm_logistics_env.report.section import number
    from swarm_logistics_env.studies.results import demands

    from .terminal_tables import show_table

    rows = []
    for demand in demands(results, effect, power):
        compared = demand.test.compared
        name = f"{compared.indicator} > {compared.threshold:.3g}, {compared.label}"
        if indicator not in (None, compared.indicator) or at not in name:
            continue
        rows.append(
            (
                compared.policy,
                name,
                number(demand.effect),
                demand.problem or str(demand.seeds),
                "–" if demand.least_power is None else f"{demand.least_power:.0%}",
                number(demand.detectable),
                number(demand.unchanged, 0),
            )
        )
    if not rows:
        asked_for = [] if indicator is None else [f"--indicator {indicator}"]
        asked_for += [f"--at {at!r}"] if at else []
        made = dict.fromkeys(test.compared.indicator for test in results.verdicts)
        raise StudyError(
            f"{' '.join(asked_for) or asked}: the study makes no such comparison; "
            f"it asks about {', '.join(made)}"
        )
    n_seeds = len(results.plan.seeds)
    columns = (
        "policy", "verdict on", "assumed effect", f"seeds for {power:.0%} power on average",
        "power in nine pilots of ten at least",
        f"distance that {n_seeds} seeds find",
        f"seeds for equivalent at {results.plan.specification.margin:.0%}",
    )  # fmt: skip
    hint = f"For another effect: swarm-logistics study plan {shlex.quote(asked)} --effect 0.2"
    show_table(f"Seeds needed, from {n_seeds} seeds", columns, rows, hint)
