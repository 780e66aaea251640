"""Every preset, default and declared table, as recorded: a change of one is a change for users."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pydantic_core import to_jsonable_python

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, policies
from swarm_logistics_env.policies.biased_walk import BiasedWalkParameters
from swarm_logistics_env.policies.charging_robots import ChargingParameters
from swarm_logistics_env.policies.homing import HomingParameters
from swarm_logistics_env.policies.homing_stock import HomingStockParameters
from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.policies.policy import ScriptParameters
from swarm_logistics_env.policies.site_fidelity import SiteFidelityParameters
from swarm_logistics_env.policies.swarm_dt import SwarmDTParameters
from swarm_logistics_env.robots.middleware import Middleware
from swarm_logistics_env.study.questions.benchmark_cells import SPACE, drawn_cells
from swarm_logistics_env.study.questions.specification import (
    Ablation,
    Faults,
    Parameter,
    Sizes,
    Specification,
)
from swarm_logistics_env.study.tasks.performance import MEASURES
from swarm_logistics_env.train import load_training, preset_names
from swarm_logistics_env.train.settings import (
    Conditions,
    Evaluation,
    Indicators,
    PPOSettings,
    Scores,
    Teaching,
    WorldKind,
)
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.views.cli.app import command_line
from swarm_logistics_env.views.cli.output import PROGRAM
from swarm_logistics_env.world.rendering import palette
from swarm_logistics_env.world.scenario import SCENARIO_PRESETS
from swarm_logistics_env.world.scenario.order_file import ORDER_SHAPES
from swarm_logistics_env.world.scenario.robot_kinds import RobotKind
from tests.conftest import Check


def settings() -> Iterator[tuple[str, object]]:
    """Yield what each setting is called, and its value as JSON can have it."""
    for record in RECORDS:
        defaults = {
            name: to_jsonable_python(field.get_default(call_default_factory=True))
            for name, field in record.model_fields.items()
            if not field.is_required()
        }
        yield f"defaults of {record.__name__}", defaults
    usual = Scenario().model_dump(mode="json")
    for name, scenario in SCENARIO_PRESETS.items():
        fields = scenario.model_dump(mode="json")
        yield f"preset {name}", {x: fields[x] for x in fields if fields[x] != usual.get(x)}
    for name in preset_names():
        changes = load_training(name).model_dump(mode="json", exclude_defaults=True)
        yield f"training {name}", changes
    for name in policies.NAMES:
        parameters = getattr(policies.load(name), "parameters", None)
        if isinstance(parameters, ScriptParameters):
            yield f"policy {name}", parameters.model_dump(mode="json")
    for kind in (HomingParameters, HomingStockParameters, SwarmDTParameters):
        yield f"{kind.__name__}, small robots", {**kind.of_small_robots}
        yield f"{kind.__name__}, fast robots", {**kind.of_fast_robots}
    yield "study", Specification().model_dump(mode="json")
    for name, mode in FAILURE_MODES.items():
        yield f"failure mode {name}", repr(mode)
    for name, measure in MEASURES.items():
        yield f"measure {name}", repr(measure)
    for cell in drawn_cells("development", "any text", 12):
        yield f"cell {cell.title}", cell.model_dump(mode="json", exclude_defaults=True)
    yield "space of cells", SPACE
    yield "orders", ORDER_SHAPES
    yield "dark colours", palette.DARK_COLOURS


RECORDS = (
    Scenario, RobotKind, Fault, Middleware, Network, Training, WorldKind, Conditions, Indicators,
    PPOSettings, Teaching, Evaluation, Scores, Sizes, Faults, Parameter, Ablation,
    BiasedWalkParameters, ChargingParameters, HomingParameters, HomingStockParameters,
    SiteFidelityParameters, SwarmDTParameters,
)  # fmt: skip
# What limits a value, by JSON Schema's words.
LIMITS = (
    "minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum", "minItems", "maxItems",
    "minLength", "maxLength", "pattern", "enum", "const",
)  # fmt: skip


def limits_in(schema: object) -> Iterator[str]:
    """Yield what limits values anywhere in a schema."""
    if isinstance(schema, list):
        for part in schema:
            yield from limits_in(part)
    if isinstance(schema, dict):
        for word in LIMITS:
            value = schema.get(word)
            if isinstance(value, int | float):
                yield f"{word} {value:g}"
            elif value is not None and not (word == "enum" and "const" in schema):
                yield f"{word} {value!r}"
        for name, part in schema.items():
            if name not in LIMITS:
                yield from limits_in(part)


def limits_of_fields() -> Iterator[str]:
    """Yield what the fields of records may be."""
    for record in RECORDS:
        for name, schema in record.model_json_schema()["properties"].items():
            if limit := ", ".join(limits_in(schema)):
                yield f"field {record.__name__}.{name}: {limit}"


def options(command: Any, name: str) -> Iterator[str]:
    """Yield what each option of a command, and of those below it, usually is and may be."""
    for parameter in command.params:
        names = " ".join([*parameter.opts, *parameter.secondary_opts])
        usual = getattr(parameter.default, "value", parameter.default)
        limits = parameter if hasattr(parameter, "min") else parameter.type  # of older typers
        ends = [getattr(limits, end, None) for end in ("min", "max")]
        flags = f"required {parameter.required}, repeated {parameter.multiple}"
        yield f"option {name}, {names}: {usual!r}, within {ends}, {flags}"
    for below, inner in getattr(command, "commands", {}).items():
        yield from options(inner, f"{name} {below}")


def test_settings_are_as_recorded(check_recorded: Check) -> None:
    lines = [f"{name}: {json.dumps(value)}" for name, value in settings()]
    lines += limits_of_fields()
    lines += options(command_line(), PROGRAM)
    check_recorded("settings.txt", lines)
