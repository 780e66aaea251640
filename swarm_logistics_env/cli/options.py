"""Options that several commands share, and what they mean."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.errors import FaultError, ScenarioError
from swarm_logistics_env.records import read_table
from swarm_logistics_env.scenario import SCENARIO_PRESETS, Scenario

if TYPE_CHECKING:
    from swarm_logistics_env.warehouse.faults import Fault

PresetOption = Annotated[
    str, typer.Option(help=f"Scenario to start from: {', '.join(SCENARIO_PRESETS)}.")
]
ScenarioOption = Annotated[
    Path | None,
    typer.Option(
        "--scenario",
        metavar="FILE",
        help="TOML or JSON file of fields to change, as `scenario --json` writes it.",
    ),
]
FAULT_FORM = "MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]]"
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option("--fault", help=f"{FAULT_FORM}, e.g. FM1:2@200; may be repeated."),
]
PolicyOption = Annotated[
    str,
    typer.Option(
        help="Name (`policies` lists them), path of a policy file, or package.module:Class."
    ),
]
SeedOption = Annotated[int, typer.Option(help="Decides everything random.")]
TrustPolicyOption = Annotated[
    bool, typer.Option("--trust-code", help="Read a .zip policy, which executes the code in it.")
]

_NUMBER = r"\d+\.?\d*|\.\d+"
_FAULT = re.compile(
    r"(?P<mode>\w+(\[[\w,]+\])?)(:(?P<robots>\d+)(:(?P<role>\w+))?)?"
    rf"(@(?P<onset>{_NUMBER})(\+(?P<duration>{_NUMBER}))?)?"
)


def scenario_of(preset: str, file: Path | None, changes: list[str] | None) -> Scenario:
    """Return the scenario that `--preset`, `--scenario` and `--set` describe.

    A file changes fields of the preset, and `--set` those of both.

    Raises:
        ScenarioError: no such preset, file or field, or a value that cannot be.
    """
    fields = {} if file is None else read_table(file, "file of --scenario", ScenarioError)
    preset = str(fields.pop("preset", preset))
    for change in changes or []:
        name, equals, value = change.partition("=")
        if not equals:
            raise ScenarioError(f"--set {change}: should be FIELD=VALUE")
        try:
            fields[name] = json.loads(value)
        except (json.JSONDecodeError, RecursionError):
            fields[name] = value
    return Scenario.preset(preset).replace(**fields)


def faults_of(texts: list[str] | None, scenario: Scenario) -> list[Fault]:
    """Return the faults that `--fault MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]]` describes.

    Raises:
        FaultError: a text does not read so, there is no such fault, or the episode ends before.
    """
    from swarm_logistics_env.warehouse.faults import Fault

    faults = []
    for text in texts or []:
        match = _FAULT.fullmatch(text)
        if match is None:
            raise FaultError(f"--fault {text}: should be {FAULT_FORM}, e.g. FM1:2@200")
        onset = float(match["onset"] or 0)
        if onset >= scenario.duration:
            raise FaultError(
                f"--fault {text}: should begin before the episode ends at {scenario.duration:g} s"
            )
        faults.append(
            Fault(
                match["mode"],
                int(match["robots"] or 1),
                onset=onset,
                duration=float(match["duration"]) if match["duration"] else None,
                role=match["role"],
            )
        )
    return faults


def fault_option(fault: Fault) -> str:
    """Return the `--fault` that describes the fault."""
    role = f":{fault.role}" if fault.role else ""
    until = f"+{fault.duration:g}" if fault.duration else ""
    return f"--fault {fault.mode}:{fault.robots}{role}@{fault.onset:g}{until}"
