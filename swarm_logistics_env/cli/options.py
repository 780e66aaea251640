"""Options that several commands share, and what they mean."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarm_logistics_env.errors import FaultError, ScenarioError

if TYPE_CHECKING:
    from swarm_logistics_env.scenario import Scenario
    from swarm_logistics_env.warehouse.faults import Fault

PresetOption = Annotated[str, typer.Option(help="Scenario to start from.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option("--fault", help="MODE[:ROBOTS][@ONSET], e.g. FM1:2@200; may be repeated."),
]
PolicyOption = Annotated[
    str, typer.Option(help="Name, path of a policy file, or package.module:Class.")
]
SeedOption = Annotated[int, typer.Option(help="Decides everything random.")]
TrustPolicyOption = Annotated[
    bool, typer.Option("--trust-code", help="Read a .zip policy, which executes the code in it.")
]

_FAULT = re.compile(r"(?P<mode>\w+)(:(?P<robots>\d+))?(@(?P<onset>\d+\.?\d*|\.\d+))?")


def scenario_of(preset: str, changes: list[str] | None) -> Scenario:
    """Return the scenario that `--preset` and `--set` describe.

    Raises:
        ScenarioError: no such preset or field, or a value that cannot be.
    """
    from swarm_logistics_env.scenario import Scenario

    fields: dict[str, Any] = {}
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise ScenarioError(f"--set {change}: should be FIELD=VALUE")
        try:
            fields[name] = json.loads(value)
        except (json.JSONDecodeError, RecursionError):
            fields[name] = value
    return Scenario.preset(preset).replace(**fields)


def faults_of(texts: list[str] | None) -> list[Fault]:
    """Return the faults that `--fault MODE[:ROBOTS][@ONSET]` describes.

    Raises:
        FaultError: a text does not read so, or there is no such fault.
    """
    from swarm_logistics_env.warehouse.faults import Fault

    faults = []
    for text in texts or []:
        match = _FAULT.fullmatch(text)
        if match is None:
            raise FaultError(f"--fault {text}: should be MODE[:ROBOTS][@ONSET], e.g. FM1:2@200")
        faults.append(
            Fault(match["mode"], int(match["robots"] or 1), onset=float(match["onset"] or 0))
        )
    return faults
