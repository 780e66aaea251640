"""`swarm-logistics export`: a policy as a file for robots."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

from typer import Argument, Option, echo

from swarm_logistics_env.core.errors import RobotError, suggest
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies import Policy, write_onnx
from swarm_logistics_env.robots.c_export import write_c
from swarm_logistics_env.robots.contract import contract_of
from swarm_logistics_env.study.report.section import slug
from swarm_logistics_env.world.scenario import Scenario

from .policy_choice import TrustOption, policies_of
from .world_choice import PresetOption, ScenarioOption, SetOption, scenario_of


def _write_contract(policy: Policy, scenario: Scenario, path: Path) -> Path:
    text = contract_of(policy, scenario).to_yaml()
    with atomic_write(path, RobotError) as part:
        part.write_text(text, encoding="utf-8")
    return path


def _write_onnx(policy: Policy, _: Scenario, path: Path) -> Path:
    write_onnx(policy, path)
    return path


# The end of a file's name, and what writes it for the robots of a scenario and returns what to say.
FORMATS: dict[str, tuple[str, Callable[[Policy, Scenario, Path], object]]] = {
    "c": (".c", write_c),
    "contract": (".yaml", _write_contract),
    "onnx": (".onnx", _write_onnx),
}


def export_command(
    policy: Annotated[
        str, Argument(help="Name (`list policies`), path of a file, module:Class or my.py:Class.")
    ],
    to: Annotated[str, Option(help=f"Format: {', '.join(FORMATS)}.")],
    out: Annotated[
        Path | None, Option(help="File; the policy's name in this folder if not given.")
    ] = None,
    preset: PresetOption = None,
    scenario_file: ScenarioOption = None,
    changes: SetOption = None,
    trust_code: TrustOption = False,
) -> None:
    """Write a policy for robots: as C, its contract, or its network."""
    if to not in FORMATS:
        raise RobotError(f"--to {to}: no such format{suggest(to, FORMATS)}")
    (spec,) = policies_of([policy], trust_code)
    scenario = scenario_of(preset, scenario_file, changes, policies=[spec])
    suffix, write = FORMATS[to]
    path = out or Path(f"{slug(spec.title)}{suffix}")
    written = write(spec.load(), scenario, path)
    echo(f"Written: {written}")
