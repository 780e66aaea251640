"""The public interface, an entry a line, in docs/api.txt: `python -m docs.api` writes it.

It writes no change that the changelog does not tell: the name of each entry that went, came or
changed has to stand in the section "Unreleased" of CHANGELOG.md.
"""

import inspect
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np

from docs.generate import FACTORS, PARTS, commands, default
from docs.python_reference import PACKAGE, STABLE, VALUES, named, signature_text
from research.tables import ROOT
from swarm_logistics_env import FAILURE_MODES, SCENARIO_PRESETS, Fault, Scenario
from swarm_logistics_env.core.moved_names import MOVED
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.environment.reward_terms import REWARD_TERMS
from swarm_logistics_env.policies.catalogue import NAMES
from swarm_logistics_env.policies.learned import PolicyCard
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.robots.contract import Contract
from swarm_logistics_env.robots.fault_layer import TRIAL_COLUMNS
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.runs.store import SCHEMA_VERSION, Runs
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import TASKS, Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.trials.words import COLUMN_NAMES
from swarm_logistics_env.study.verdicts.columns import CELL_COLUMNS, VERDICT_COLUMNS
from swarm_logistics_env.train.training import Training, preset_names
from swarm_logistics_env.views.cli.app import command_line
from swarm_logistics_env.views.cli.exporting import FORMATS
from swarm_logistics_env.views.cli.output import EXIT_CODES
from swarm_logistics_env.world.floor.floor_plan import plan_names
from swarm_logistics_env.world.motion import INPUTS, OUTPUTS
from swarm_logistics_env.world.observations import columns
from swarm_logistics_env.world.scenario.order_file import COLUMNS

FILE = ROOT / "docs" / "api.txt"
HEAD = """\
The public interface of swarm-logistics-env, an entry a line: kind: name: what it takes or is.
Written by `python -m docs.api`; docs/versions.md says what is promised of it.
"""
Entry = tuple[str, str, str]  # kind, name, what it takes or is


def entries() -> Iterator[Entry]:
    """Yield all that users rely on by name."""
    yield from python_entries()
    yield from command_entries()
    for kind, record in (("scenario field", Scenario), ("fault field", Fault)):
        yield from field_entries(kind, record)
    yield from field_entries("training field", Training, parts=PARTS)
    yield from field_entries("study field", Specification, parts=FACTORS)
    # A small message, so that its columns are there.
    for column in columns(Scenario(message_size=1)):
        yield "observation column", column.name, column.unit
    for number, name in enumerate((*INPUTS, *OUTPUTS)):
        yield "input or output of a network", name, str(number)
    yield from column_entries()
    yield "file format", "policy", of_format(PolicyCard)
    yield "file format", "contract", of_format(Contract)
    yield "file format", "store", str(SCHEMA_VERSION)


def python_entries() -> Iterator[Entry]:
    """Yield the stable names with their signatures, the members that are told with them, values."""
    for name in VALUES:
        yield "python", f"{PACKAGE}.{name}", "value"
    for names in STABLE.values():
        for name, members in names.items():
            value = named(name)
            # The fields of a scenario and of a fault have lines of their own.
            is_listed = value in (Scenario, Fault)
            yield "python", f"{PACKAGE}.{name}", "record" if is_listed else signature_text(value)
            for member in members:
                attribute = inspect.getattr_static(value, member)
                yield "python", f"{PACKAGE}.{name}.{member}", signature_text(attribute)
    for former, today in MOVED.items():
        yield "former name", f"{PACKAGE}.{former}", f"{PACKAGE}.{today}"


def command_entries() -> Iterator[Entry]:
    """Yield commands, their options, codes of exit, and what they know by name."""
    for name, _, options in commands(command_line(), "swarm-logistics"):
        command = name.strip("`")
        yield "command", command, ""
        for option in re.findall(r"`(.+?)`", options):
            yield "option", f"{command} {option}", ""
    for code, meaning in EXIT_CODES.items():
        yield "exit code", str(code), meaning
    names_by_kind: dict[str, Iterable[str]] = {
        "policy": NAMES,
        "failure mode": FAILURE_MODES,
        "reward term": REWARD_TERMS,
        "indicator": DEFINITIONS,
        "scenario preset": SCENARIO_PRESETS,
        "floor plan": plan_names(),
        "training preset": preset_names(),
        "study preset": PRESETS,
        "task": TASKS,
        "export format": FORMATS,
    }
    for kind, names in names_by_kind.items():
        for name in names:
            yield kind, name, ""


def field_entries(kind: str, record: type[Record], parts: Iterable[str] = ()) -> Iterator[Entry]:
    """Yield the fields of a record with their defaults; then those of its parts."""
    for name in record.model_fields:
        yield kind, name, default(record, name).replace("`", "")
    for part in parts:
        annotation: Any = record.model_fields[part].annotation
        table, *_ = get_args(annotation) or [annotation]
        for name in table.model_fields:
            text = default(table, name).replace("`", "")
            is_list = get_origin(annotation) is tuple
            yield kind, f"{part}[].{name}" if is_list else f"{part}.{name}", text


def column_entries() -> Iterator[Entry]:
    """Yield the columns of files that are written and read."""
    yield from (("column of cells.csv", name, "") for name in CELL_COLUMNS)
    yield from (("column of claims.csv", name, "") for name in VERDICT_COLUMNS)
    spec = PolicySpec(name="homing", label="homing")
    case = Case(spec, "identity", Scenario(), task=WAREHOUSE)
    with Runs(None) as runs:
        outcome = Outcome(np.array([1.0]), 500.0, False, (), 1.0, all_served=False)
        runs.add([(Run(case, "code", 0), outcome)])
        yield from (("column of study export", str(name), "") for name in runs.frame())
    yield from (("column of append_trial", name, "") for name in TRIAL_COLUMNS)
    yield from (("column of a file of orders", name, "") for name in COLUMNS)
    yield from (("column of trials", name, "") for name in COLUMN_NAMES)


def of_format(record: type[Record]) -> str:
    """Return the version of a file's format."""
    return str(record.model_fields["format"].default)


def api_text() -> str:
    """Return the file as the code has it."""
    lines = [f"{kind}: {name}: {about}".rstrip(": ") for kind, name, about in entries()]
    return HEAD + "\n" + "\n".join(lines) + "\n"


def untold_changes(before: str, after: str, changelog: str) -> list[str]:
    """Return the lines that went (-) or came (+) whose name the changelog does not tell.

    Args:
        before, after: texts of the file.
        changelog: that of CHANGELOG.md, of which the section "Unreleased" counts.
    """
    section = re.search(
        r"^## \[Unreleased\]\n(.*?)(?=^## |\Z)", changelog, re.DOTALL | re.MULTILINE
    )
    unreleased = section[1] if section else ""
    former_lines = set(before.splitlines())
    lines = set(after.splitlines())
    changes = [f"- {line}" for line in before.splitlines() if line not in lines]
    changes += [f"+ {line}" for line in after.splitlines() if line not in former_lines]
    return [change for change in changes if not is_told(change, unreleased)]


def is_told(change: str, section: str) -> bool:
    """Return whether a section of the changelog has the name of a line of the file in it."""
    name = change.split(": ")[1]
    # Of swarm_logistics_env.spi.robustness, ppo[].clip and judge --seeds the last part.
    last = re.split(r"[ .](?=[^ .]+$)", name)[-1]
    return re.search(rf"(?<![\w-]){re.escape(last)}(?![\w-])", section) is not None


def write(file: Path = FILE, changelog: Path = ROOT / "CHANGELOG.md") -> None:
    """Write the file.

    Raises:
        SystemExit: the changelog does not tell of a change; says which.
    """
    after = api_text()
    if file.exists():
        untold = untold_changes(file.read_text("utf-8"), after, changelog.read_text("utf-8"))
        if untold:
            lines = "\n".join(untold)
            raise SystemExit(f'Not in the section "Unreleased" of CHANGELOG.md:\n{lines}')
    file.write_text(after, encoding="utf-8")


if __name__ == "__main__":
    write()
