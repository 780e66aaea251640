"""Importing: results from elsewhere (a paper's tables, another lab's runs) judged like ours."""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.studies import metadata
from swarm_logistics_env.studies.comparisons import NO_FAULT, Comparison, Setting
from swarm_logistics_env.studies.plan import Plan, adaptability, robustness, scalability
from swarm_logistics_env.studies.runs import StudiedPolicy
from swarm_logistics_env.studies.specification import Specification
from swarm_logistics_env.studies.store import new_store, refuse_study_in
from swarm_logistics_env.tasks.task import Outcome

CODE = "imported"
_NEEDED = ("kind", "name", "value", "delivered")
_COLUMNS = (*_NEEDED, "n_robots", "policy", "seed")
_TITLES = {"size": "Scalability", "fault": "Fault tolerance and robustness"}


@dataclass(frozen=True)
class Origin:
    """Where imported results came from.

    Attributes:
        file: its name; digest: of its content; paired: whether its rows name their seeds.
        seeds: those that they name; empty: none, or the store was made when seeds were numbered
            anew from 0 on.
    """

    file: str
    digest: str
    paired: bool
    seeds: tuple[int, ...] = ()


@dataclass(frozen=True)
class _Row:
    line: int
    policy: str
    setting: Setting
    n_robots: int | None
    seed: int | None
    delivered: int

    @property
    def title(self) -> str:
        """Heading of the table it belongs to."""
        return _TITLES.get(self.setting.kind, f"Adaptability to {self.setting.name}")


def import_results(file: Path, out: Path) -> int:
    """Make a study of a CSV file with one run a row; return how many runs it holds.

    Columns: `kind` (size, fault or parameter), `name` (n_robots; none, removed or a failure mode;
    a scenario field), `value` (N; m; the parameter's, x_o in its first row), `delivered` (P),
    `n_robots` (N of fault rows), and where known `policy` and `seed`. With a seed in every row the
    study is paired; with none it is not, and rows of one condition are its runs.

    Args:
        file: the CSV.
        out: directory of the study; it may not hold another.

    Raises:
        StudyError: the file cannot be read, or a row of it cannot be.
    """
    refuse_study_in(out, "import")
    try:
        content = file.read_bytes()
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise StudyError(f"cannot read {file}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise StudyError(f"{file} is not a CSV file in UTF-8: {error.reason}") from error
    try:
        rows = list(_rows(file, text))
    except csv.Error as error:
        raise StudyError(f"{file} is not a CSV file: {error}") from error
    if not rows:
        raise StudyError(f"{file} holds no run")
    cells = _cells(file, rows)
    seeds = tuple(sorted({row.seed for row in rows if row.seed is not None}))
    specification = _specification(file, rows, max(map(len, cells.values())))
    origin = Origin(file.name, hashlib.sha256(content).hexdigest()[:16], bool(seeds), seeds)
    plan = imported_plan(specification, origin)
    with new_store(out) as store:
        for policy, title, arm in plan.cells:
            found = cells.get((policy, title, arm.setting), [])
            for number, row in enumerate(found):
                run = arm.condition.run(CODE, number if row.seed is None else row.seed)
                store.add(run, Outcome(run.key, untimed=row.delivered))
        store.set_note(metadata.SPECIFICATION, specification.to_json())
        store.set_note(metadata.CODE, CODE)
        store.set_note(metadata.IDENTITIES, "{}")
        store.set_note(metadata.DECLARED_SEEDS, str(specification.seeds))
        store.set_note(metadata.IMPORTED, json.dumps(asdict(origin)))
    return len(rows)


def imported_plan(specification: Specification, origin: Origin) -> Plan:
    """Return the plan of imported results: no condition is shared between two of its tables.

    A paper's tables may give several values of P for what we would call one condition.
    """
    comparisons: list[Comparison] = []
    base, task = specification.scenario, specification.played

    def policy_of(label: str, title: str) -> StudiedPolicy:
        return StudiedPolicy(label, f"{origin.file} ({origin.digest}), {title}", label)

    for label in specification.policies:
        for sizes in specification.sizes:
            comparisons += scalability(base, sizes, policy_of(label, sizes.title), task)
        for faults in specification.faults:
            asked = robustness(base, faults, policy_of(label, faults.title), task)
            comparisons += [item for item in asked if isinstance(item, Comparison)]
        for parameter in specification.parameters:
            comparisons += adaptability(base, parameter, policy_of(label, parameter.title), task)
    return Plan(
        specification,
        tuple(comparisons),
        CODE,
        {},
        paired=origin.paired,
        imported_from=origin.file,
        imported_seeds=tuple(origin.seeds),
    )


def _rows(file: Path, text: str) -> Iterator[_Row]:
    reader = csv.DictReader(text.splitlines(), restkey="", restval="")
    columns = reader.fieldnames or ()
    for needed in _NEEDED:
        if needed not in columns:
            raise StudyError(f"{file} has no column {needed!r}: it needs {', '.join(_NEEDED)}")
    for column in columns:
        if column not in _COLUMNS:
            raise StudyError(f"{file} has a column {column!r}{suggest(column, _COLUMNS)}")
    for values in reader:
        place = f"{file}, line {reader.line_num}"
        if "" in values:
            raise StudyError(f"{place}: has more values than the file has columns")
        setting = _level(place, values)
        if setting.kind == "fault" and not values.get("n_robots"):
            raise StudyError(f"{place}: n_robots is missing, without which R is undefined")
        yield _Row(
            reader.line_num,
            values.get("policy") or "imported",
            setting,
            _whole(place, "n_robots", values.get("n_robots"), 1),
            _whole(place, "seed", values.get("seed"), 0),
            _whole(place, "delivered", values["delivered"] or "nothing", 0) or 0,
        )


def _level(place: str, values: dict[str, str]) -> Setting:
    kind, name = values["kind"], values["name"]
    try:
        value = float(values["value"])
    except ValueError:
        raise StudyError(f"{place}: value = {values['value']!r}: should be a number") from None
    if kind == "size":
        return Setting("size", "n_robots", _whole(place, "value", values["value"], 1) or 0)
    if kind == "fault":
        m = _whole(place, "value", values["value"], 0) or 0
        return NO_FAULT if name == "none" else Setting("fault", name, m)
    if kind == "parameter":
        return Setting("parameter", name, value)
    known = ("size", "fault", "parameter")
    raise StudyError(f"{place}: kind = {kind!r}{suggest(kind, known)}")


def _whole(place: str, name: str, text: str | None, least: int) -> int | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not (value >= least and value == int(min(value, 1e15))):
        raise StudyError(f"{place}: {name} = {text}: should be a whole number, {least} or more")
    return int(value)


def _cells(file: Path, rows: list[_Row]) -> dict[tuple[str, str, Setting], list[_Row]]:
    cells: dict[tuple[str, str, Setting], list[_Row]] = {}
    for row in rows:
        cells.setdefault((row.policy, row.title, row.setting), []).append(row)
    with_seed = [row for row in rows if row.seed is not None]
    if with_seed and len(with_seed) < len(rows):
        bare = next(row for row in rows if row.seed is None)
        raise StudyError(f"{file}, line {bare.line}: has no seed, as other rows have")
    seeds = sorted({row.seed for row in with_seed if row.seed is not None})
    for (policy, _, setting), found in cells.items():
        if not seeds:
            continue
        theirs = sorted(row.seed for row in found if row.seed is not None)
        if len(set(theirs)) < len(theirs):
            raise StudyError(f"{file}: {policy}, {setting} has two rows of one seed")
        if theirs != seeds:
            raise StudyError(
                f"{file}: {policy}, {setting} has {len(theirs)} of the file's {len(seeds)} seeds: "
                "give every condition the same seeds, or leave the column out"
            )
    return cells


def _specification(file: Path, rows: list[_Row], seeds: int) -> Specification:
    fields: dict[str, Any] = {
        "name": file.stem,
        "policies": list(dict.fromkeys(row.policy for row in rows)),
        "seeds": seeds,
        "sizes": [],
        "faults": [],
        "parameters": [],
    }
    # Tables keep the order of the file, because a parameter's first value is x_o.
    for title in dict.fromkeys(row.title for row in rows):
        table = [row for row in rows if row.title == title]
        settings = list(dict.fromkeys(row.setting for row in table))
        values = [setting.value for setting in settings]
        kind = settings[0].kind
        if kind != "fault" and len(settings) < 2:
            raise StudyError(
                f"{file}: {title}: {settings[0]} stands alone, nothing to compare with"
            )
        if kind == "size":
            fields["sizes"].append({"title": title, "values": sorted(int(v) for v in values)})
        elif kind == "parameter":
            fields["parameters"].append(
                {"title": title, "name": settings[0].name, "values": values}
            )
        else:
            fields["faults"].append(_faults(file, title, table))
    try:
        return Specification(**fields)
    except StudyError as error:
        raise StudyError(f"{file}: {error}") from error


def _faults(file: Path, title: str, table: list[_Row]) -> dict[str, Any]:
    for policy in dict.fromkeys(row.policy for row in table):
        if not any(row.setting == NO_FAULT for row in table if row.policy == policy):
            raise StudyError(f"{file}: {policy} has faults, but no row without one (name none)")
    swarms = {row.n_robots for row in table}
    if len(swarms) > 1:
        raise StudyError(f"{file}: faults in swarms of several sizes {sorted(map(str, swarms))}")
    failing = [row.setting for row in table if row.setting != NO_FAULT]
    return {
        "title": title,
        "modes": list(dict.fromkeys(lv.name for lv in failing if lv.name != "removed")),
        "robots": sorted({int(setting.value) for setting in failing}),
        "scenario": {"n_robots": swarms.pop()},
    }
