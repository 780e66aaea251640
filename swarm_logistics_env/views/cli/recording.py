"""`swarm-logistics record`: demonstrations of policies as files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option, echo

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies.demonstrations import record
from swarm_logistics_env.study.report.section import slug

from .policy_choice import TrustOption, policies_of
from .world_choice import (
    FaultOption,
    PresetOption,
    Repeated,
    ScenarioOption,
    SeedOption,
    SetOption,
    faults_of,
    scenario_of,
)

DEFAULT_POLICIES = ["homing", "ppo-robust", "swarm-dt"]


def record_command(
    policies: Annotated[
        Repeated,
        Option(
            "--policy",
            help="As of `run`; may be repeated. If not given: " + ", ".join(DEFAULT_POLICIES) + ".",
        ),
    ] = None,
    episodes: Annotated[int, Option(min=1, help="Of each policy.")] = 10,
    seed: SeedOption = 0,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    frame: Annotated[
        bool, Option("--frame", help="As through MotionFrame: easier to learn from.")
    ] = False,
    out: Annotated[Path, Option(help="Folder of the files, NAME.parquet.")] = Path(
        "results/demonstrations"
    ),
    minari: Annotated[
        bool, Option("--minari", help="Make Minari's data sets swarm-logistics/NAME-v0 as well.")
    ] = False,
    trust_code: TrustOption = False,
) -> None:
    """Record what policies do, to learn from it."""
    specs = policies_of(policies or DEFAULT_POLICIES, trust_code)
    scenario = scenario_of(preset, scenario_file, changes, policies=specs)
    scheduled = faults_of(faults, scenario)
    players = [(spec, spec.load()) for spec in specs]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SetupError(f"--out {out}: cannot be made: {error.strerror}") from error
    for spec, player in players:
        demonstrations = record(
            player, episodes, scenario=scenario, seed=seed, faults=scheduled, frame=frame
        )
        path = out / f"{slug(spec.title)}.parquet"
        demonstrations.to_parquet(path)
        echo(f"{path}: {demonstrations!r}")
        if minari:
            name = f"swarm-logistics/{slug(spec.title)}-v0"
            demonstrations.to_minari(name)
            echo(f"Minari data set {name}")
