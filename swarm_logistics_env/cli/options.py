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
TrustPolicyOption = Annotated[
    bool, typer.Option("--trust-code", help="Read a .zip policy: executes the code in it.")
]

_FAULT = re.compile(r"(?P<mode>\w+)(:(?P<robots>\d+))?(@(?P<onset>[\d.]+))?")


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


def fault_of(text: str) -> Fault:
    """Return the fault that MODE[:ROBOTS][@ONSET] describes.

    Raises:
        FaultError: the text does not read so, or there is no such fault.
    """
    from swarm_logistics_env.warehouse.faults import Fault

    match = _FAULT.fullmatch(text)
    if match is None:
        raise FaultError(f"--fault {text}: should be MODE[:ROBOTS][@ONSET], e.g. FM1:2@200")
    try:
        onset = float(match["onset"] or 0)
    except ValueError:
        raise FaultError(f"--fault {text}: the onset should be a number of seconds") from None
    return Fault(match["mode"], int(match["robots"] or 1), onset=onset)
