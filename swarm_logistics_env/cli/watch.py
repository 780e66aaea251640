"""`swarm-logistics watch`."""

from __future__ import annotations

from typing import Annotated

import typer

from swarm_logistics_env.cli.app import app
from swarm_logistics_env.cli.options import (
    FaultOption,
    PresetOption,
    SetOption,
    TrustPolicyOption,
    fault_of,
    scenario_of,
)


@app.command("watch")
def watch_command(
    policy: Annotated[
        str, typer.Option(help="Name, path of a policy file, or package.module:Class.")
    ] = "swarm-dt",
    seed: Annotated[int, typer.Option(help="Of the first episode.")] = 0,
    preset: PresetOption = "paper",
    changes: SetOption = None,
    faults: FaultOption = None,
    speed: Annotated[float, typer.Option(help="Times real time.")] = 1.0,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="On this machine only; 0: any free one.")
    ] = 8765,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Watch a run in the browser beside its fault-free twin; inspect, break and repair robots."""
    from swarm_logistics_env import policies
    from swarm_logistics_env.watch import Session
    from swarm_logistics_env.watch.web import serve

    session = Session(
        scenario_of(preset, changes),
        lambda: policies.load(policy, trust_code=trust_code),
        seed,
        [fault_of(text) for text in faults or []],
        speed,
    )
    serve(session, policy, port, announce=typer.echo)
