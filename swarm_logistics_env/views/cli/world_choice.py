"""The world that a command line means: a preset, a file, changes, or where a policy learned."""

from __future__ import annotations

import contextlib
import json
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, TypeAlias, get_args

from typer import Option

from swarm_logistics_env.core.errors import FaultError, ScenarioError
from swarm_logistics_env.core.records import read_table
from swarm_logistics_env.policies import PolicySpec, read_card
from swarm_logistics_env.policies.catalogue import NAMES
from swarm_logistics_env.policies.files import SUFFIX
from swarm_logistics_env.world.bodies import BODIES
from swarm_logistics_env.world.scenario import CHIPMUNK, SCENARIO_PRESETS, Scenario
from swarm_logistics_env.world.warehouse.faults import Fault, fault_of

from .terminal import say

Repeated: TypeAlias = list[str] | None  # the texts of an option that may be given several times
USUAL_PRESET = "paper"
PresetOption = Annotated[
    str | None,
    Option(
        help=f"Scenario to start from: {', '.join(SCENARIO_PRESETS)}. If not given, that in which "
        f"a policy file was trained, or {USUAL_PRESET}.",
    ),
]
ScenarioOption = Annotated[
    Path | None,
    Option(
        "--scenario",
        metavar="FILE",
        help="TOML or JSON file of fields to change, as `list scenario --json` writes it.",
    ),
]
SetOption = Annotated[
    Repeated, Option("--set", metavar="FIELD=VALUE", help="Change a field; may be repeated.")
]
BodiesOption = Annotated[
    str | None,
    Option(
        help=f"What moves the robots: {', '.join([CHIPMUNK, *BODIES])}, module:Class or "
        "my.py:Class; as --set bodies=.."
    ),
]
SeedOption = Annotated[int, Option(min=0, help="Decides everything random.")]
FaultOption = Annotated[
    Repeated,
    Option(
        "--fault",
        metavar="FAULT",
        help="Such as FM1:2@200: two robots from 200 s on (`list faults`); may be repeated.",
    ),
]


def scenario_of(
    preset: str | None,
    file: Path | None,
    changes: Repeated,
    bodies: str | None = None,
    *,
    policies: Iterable[PolicySpec] = (),
    usual: Scenario | None = None,
) -> Scenario:
    """Return the scenario that `--preset`, `--scenario`, `--set` and `--bodies` describe.

    A file changes fields of the preset, and `--set` those of both.

    Args:
        policies: where neither preset nor file is named, the scenario is the one in which the first
            policy file among these was trained, which is told.
        usual: the scenario where there is no such policy, which is told; None: the preset
            `USUAL_PRESET`.

    Raises:
        ScenarioError: no such preset, file or field, or a value that cannot be.
    """
    fields = {} if file is None else read_table(file, "file of --scenario", ScenarioError)
    preset = fields.pop("preset", preset)
    base = None
    if not (preset or file):
        base = _training_scenario(policies)
        if base is None and usual is not None:
            back = ", where items come back" if usual.restock else ""
            say(
                f"In the world of the preset {USUAL_PRESET}{back}; --preset or --scenario names "
                "another."
            )
            base = usual
    base = base or Scenario.preset(str(preset or USUAL_PRESET))
    return base.replace(**{**fields, **changed_fields(changes, bodies)})


def options_of_world(
    preset: str | None, file: Path | None, changes: Repeated, bodies: str | None
) -> list[str]:
    """Return the options that choose the same scenario again, each followed by its value."""
    options = [("--preset", preset), ("--scenario", file), ("--bodies", bodies)]
    options += [("--set", change) for change in changes or []]
    return [str(word) for option in options if option[1] for word in option]


def _training_scenario(policies: Iterable[PolicySpec]) -> Scenario | None:
    """Return in which scenario the first policy file was trained; None: there is no such file."""
    for policy in policies:
        for training in policy.trainings or (policy,):
            if training.name.endswith(SUFFIX) and training.name not in NAMES:
                card = read_card(Path(training.name))
                say(f"In the world in which {card.name} was trained; --preset names another.")
                return Scenario(**card.scenario)
    return None


def changed_fields(changes: Repeated, bodies: str | None) -> dict[str, Any]:
    """Return the fields that `--set` and `--bodies` change, with their values.

    Raises:
        ScenarioError: a change is not FIELD=VALUE, or a field is changed twice.
    """
    texts = [*(changes or []), *([] if bodies is None else [f"bodies={bodies}"])]
    fields: dict[str, Any] = {}
    for change in texts:
        name, equals, value = change.partition("=")
        name = name.strip()
        if not (equals and name):
            raise ScenarioError(f"--set {change}: should be FIELD=VALUE")
        if name in fields:
            raise ScenarioError(f"--set {change}: {name} is set twice: should be set once")
        fields[name] = _value_of(value.strip())
        if fields[name] == "none" and _may_be_absent(name):
            fields[name] = None
    return fields


def _may_be_absent(name: str) -> bool:
    field = Scenario.model_fields.get(name)
    return field is not None and type(None) in get_args(field.annotation)


def _value_of(text: str) -> Any:
    """Return the value that a text is in JSON or TOML; else the text itself."""
    with contextlib.suppress(ValueError, RecursionError):
        return json.loads(text)
    with contextlib.suppress(ValueError, RecursionError):
        (value,) = tomllib.loads(f"value = {text}").values()
        if isinstance(value, int | float | str):  # TOML has dates as well
            return value
    return text


def faults_of(texts: Repeated, scenario: Scenario) -> list[Fault]:
    """Return the faults that `--fault` describes, see `faults.fault_of`.

    Raises:
        FaultError: a text does not read so, there is no such fault, or the episode ends before.
    """
    faults = [fault_of(text) for text in texts or []]
    for fault, text in zip(faults, texts or []):
        if fault.onset >= scenario.duration:
            raise FaultError(
                f"--fault {text}: should begin before the episode ends at {scenario.duration:g} s"
            )
    return faults
