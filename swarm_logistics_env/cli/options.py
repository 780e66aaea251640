"""Options that several commands share, and what they mean."""

from __future__ import annotations

import json
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
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated."),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="FAULT",
        help="MODE[:ROBOTS[:ROLE]][@ONSET[+DURATION]], e.g. FM1:2@200; may be repeated.",
    ),
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
    """Return the faults that `--fault` describes, see `fault_text`.

    Raises:
        FaultError: a text does not read so, there is no such fault, or the episode ends before.
    """
    from swarm_logistics_env.fault_text import fault_of

    faults = [fault_of(text) for text in texts or []]
    for fault, text in zip(faults, texts or []):
        if fault.onset >= scenario.duration:
            raise FaultError(
                f"--fault {text}: should begin before the episode ends at {scenario.duration:g} s"
            )
    return faults
