"""`swarm-logistics watch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import (
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
    against: Annotated[
        str | None,
        typer.Option(help="Policy of the run beside it; left out: the same without faults."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the first episode.")] = 0,
    preset: PresetOption = "paper",
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    faults: FaultOption = None,
    speed: Annotated[float, typer.Option(help="How many times real time it plays.")] = 8.0,
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Port of this machine; 0 takes any that is free."),
    ] = 8765,
    save: Annotated[
        Path | None,
        typer.Option(help="Play to the end and write a page that replays it; serve nothing."),
    ] = None,
    until: Annotated[
        float | None, typer.Option(help="With --save: time at which the replay ends [s].")
    ] = None,
    trust_code: TrustPolicyOption = False,
) -> None:
    """Watch two runs side by side in the browser; inspect, break and repair robots."""
    import os

    from swarm_logistics_env import policies
    from swarm_logistics_env.errors import SetupError
    from swarm_logistics_env.watch import Session
    from swarm_logistics_env.watch.web import recorded_page, serve
    from swarm_logistics_env.writing import becoming

    if until is not None and (save is None or not until > 0.0):
        raise SetupError(f"--until {until:g}: should be above 0 s, together with --save")
    if save is not None and (save.is_dir() or not os.access(save.parent, os.W_OK)):
        raise SetupError(f"--save {save}: should be a file in a folder that can be written to")
    scenario = scenario_of(preset, scenario_file, changes)
    given = {policies.called(name): name for name in filter(None, (policy, against))}
    session = Session(
        scenario,
        policies.called(policy),
        None if against is None else policies.called(against),
        seed,
        faults_of(faults, scenario),
        speed,
        lambda name: policies.load(given.get(name, name), trust_code=trust_code),
    )
    if save is None:
        serve(session, port, announce=typer.echo)
        return
    page = recorded_page(session, session.scenario.duration if until is None else until)
    with becoming(save, SetupError) as part:
        part.write_text(page, encoding="utf-8")
    typer.echo(f"{save}: {session.run.world.state.time:g} s, {len(page) / 1e6:.2f} MB")
