"""`swarm-logistics watch`."""

from __future__ import annotations

from typing import Annotated

import typer

from swarm_logistics_env.cli.options import (
    FaultOption,
    PolicyOption,
    PresetOption,
    ScenarioOption,
    SetOption,
    TrustPolicyOption,
    faults_of,
    scenario_of,
)


def watch_command(
    policy: PolicyOption = "swarm-dt",
    seed: Annotated[int, typer.Option(help="Seed of the first episode.")] = 0,
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    speed: Annotated[float, typer.Option(help="How many times real time it plays.")] = 1.0,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Port of this machine; 0 takes any that is free."),
    ] = 8765,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Watch a run in the browser beside its fault-free twin; inspect, break and repair robots."""
    from swarm_logistics_env import policies
    from swarm_logistics_env.watch import Session
    from swarm_logistics_env.watch.web import serve

    scenario, scheduled = scenario_of(preset, scenario_file, changes), faults_of(faults)
    session = Session(
        scenario, lambda: policies.load(policy, trust_code=trust_code), seed, scheduled, speed
    )
    serve(session, policies.called(policy), port, announce=typer.echo)
