"""Importing: trials recorded elsewhere (real robots, another lab, a paper) made a study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.definitions import comparing
from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.spi.trials import NO_FAULT, REPEATED, Trial, read_trials
from swarm_logistics_env.studies import comparisons, metadata
from swarm_logistics_env.studies.comparisons import Arm, Comparison, NullPair, Setting
from swarm_logistics_env.studies.metadata import Declaration
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.studies.specification import Specification
from swarm_logistics_env.studies.store import new_store, refuse_study_in
from swarm_logistics_env.tasks.recorded_trials import (
    RECORDED,
    Origin,
    RecordedCell,
    RecordedFault,
    RecordedScenario,
    RecordedTable,
)
from swarm_logistics_env.tasks.task import Outcome


def import_results(
    file: Path,
    out: Path,
    *,
    columns: Mapping[str, str] | None = None,
    ignore: Sequence[str] = (),
    duration: float | None = None,
    setup: Mapping[str, str] | None = None,
) -> int:
    """Make a study of a CSV file of trials (`spi.read_trials`); return how many runs it holds.

    Swarm sizes without fault, failure modes and the values of each parameter become a table each;
    the values of everything else that the file varies make tables of their own. A parameter's x_o
    is its value in the file's first row. With seeds the study is paired, without them it is not.

    Args:
        file: the CSV.
        out: directory of the study; it may not hold another.
        columns, ignore, duration: as for `spi.read_trials`.
        setup: name and value of what the report is to say of the conditions.

    Raises:
        StudyError: the file cannot be read, a row of it cannot be, or nothing is compared in it.
    """
    refuse_study_in(out, "import")
    try:
        trials = read_trials(file, columns=columns, ignore=ignore, duration=duration)
    except IndicatorError as error:
        raise StudyError(str(error)) from error
    tables = tuple(_tables(file, trials.rows))
    cells: dict[tuple[str, RecordedCell], list[Trial]] = {}
    for table in tables:
        for cell in table.cells:
            cells[table.policy, cell] = [
                row for row in trials.rows if row.policy == table.policy and _is(row, cell)
            ]
    _refuse_unused(file, trials.rows, cells.values())
    specification = Specification(
        name=file.stem,
        task=RECORDED.name,
        policies=tuple(dict.fromkeys(row.policy for row in trials.rows)),
        seeds=max(map(len, cells.values())),
    )
    origin = Origin(
        file=trials.file,
        digest=trials.digest,
        paired=trials.paired,
        seeds=tuple(sorted({row.seed for row in trials.rows if row.seed is not None})),
        setup=tuple((setup or {}).items()),
        tables=tables,
    )
    with new_store(out) as store:
        for (policy, cell), rows in cells.items():
            condition = _arm(origin, policy, cell).condition
            for number, row in enumerate(rows):
                run = condition.run(RECORDED.code(), number if row.seed is None else row.seed)
                store.add(run, _outcome(run.key, row))
        declared = Declaration.of(specification)
        notes = metadata.rows_of(specification, RECORDED.code(), {}, declared)
        store.note({**notes, "imported": origin.to_json()})
    return len(trials.rows)


def imported_plan(specification: Specification, origin: Origin) -> Plan:
    """Return the plan of recorded trials: what their tables compare, and nothing to play."""
    found = [item for table in origin.tables for item in _compared(origin, table)]
    return Plan(
        specification,
        tuple(item for item in found if isinstance(item, Comparison)),
        RECORDED.code(),
        {},
        null_pairs=tuple(item for item in found if isinstance(item, NullPair)),
        paired=origin.paired,
        imported_from=origin.file,
        imported_seeds=origin.seeds,
        setup=origin.setup,
    )


def _compared(origin: Origin, table: RecordedTable) -> Iterator[Comparison | NullPair]:
    arms = [_arm(origin, table.policy, cell) for cell in table.cells]
    original, *others = arms
    kind = original.setting.kind
    if kind == "size":
        for small, large in zip(arms, others):
            for definition in comparing(kind):
                yield Comparison(table.title, definition.symbol, small, large)
        return
    by_setting = {arm.setting: arm for arm in arms}
    for arm in others:
        setting = arm.setting
        if setting == comparisons.OTHER_BEHAVIOUR:
            yield NullPair(table.title, original, arm)
        if kind == "fault" and setting.name in (REPEATED, RECORDED.removed):
            continue
        removed = by_setting.get(setting._replace(name=str(RECORDED.removed)))
        for definition in comparing(kind):
            # Whoever recorded no trials with the robots removed asks for R alone.
            if removed is not None or not definition.needs_removed:
                third = removed if definition.needs_removed else None
                yield Comparison(table.title, definition.symbol, original, arm, third)


def _arm(origin: Origin, policy: str, cell: RecordedCell) -> Arm:
    studied = StudiedPolicy(policy, f"{policy}: {origin.file} ({origin.digest})", policy)
    scenario: Any = cell.scenario
    faults: Any = () if cell.fault is None else (cell.fault,)
    task: Any = RECORDED
    condition = Condition(studied, scenario, faults, int(cell.repeated), task=task)
    return Arm(Setting(cell.kind, cell.name, cell.value, cell.onset), condition)


def _outcome(key: str, row: Trial) -> Outcome:
    if row.times is None:
        return Outcome(key, untimed=row.performance)
    return Outcome(key, delivery_times=np.array(row.times), ended_at=row.duration or 0.0)


def _is(row: Trial, cell: RecordedCell) -> bool:
    """Whether a trial was run in a cell's condition."""
    fault = cell.fault
    return _scenario(row) == cell.scenario and (row.fault, row.faulty, row.onset) == (
        (REPEATED if cell.repeated else NO_FAULT, 0, 0.0)
        if fault is None
        else (fault.mode, fault.robots, fault.onset)
    )


def _scenario(row: Trial) -> RecordedScenario:
    return RecordedScenario(
        n_robots=row.n_robots or 0,
        duration=row.duration or 0.0,
        table=row.table,
        parameters=row.parameters,
    )


_Cells = tuple[RecordedCell, ...]
_Fixed = tuple[tuple[str, float], ...]  # name and value of what is the same in a table


def _tables(file: Path, rows: Sequence[Trial]) -> Iterator[RecordedTable]:
    """Yield what can be compared: all rows that differ in one thing alone, for each thing."""
    for policy in dict.fromkeys(row.policy for row in rows):
        own = [row for row in rows if row.policy == policy]
        for table in dict.fromkeys(row.table for row in own):
            here = [row for row in own if row.table == table]
            plain = [row for row in here if row.fault == NO_FAULT]
            if table in ("", "size"):
                sized = [row for row in plain if row.n_robots is not None]
                yield from _split(
                    policy, "Scalability", sized, lambda row: row.parameters, _size_cells
                )
            if table in ("", "fault"):
                title = "Fault tolerance and robustness"
                yield from _split(
                    policy, title, here, _all_but(None), lambda group: _fault_cells(file, group)
                )
            for name in dict.fromkeys(name for row in plain for name, _ in row.parameters):
                cells_of = partial(_parameter_cells, file, name, dict(plain[0].parameters)[name])
                title = f"Adaptability to {name}"
                yield from _split(policy, title, plain, _all_but(name), cells_of)


def _split(
    policy: str,
    general: str,
    rows: Sequence[Trial],
    fixed: Callable[[Trial], _Fixed],
    cells_of: Callable[[Sequence[Trial]], _Cells],
) -> Iterator[RecordedTable]:
    """Yield a table for each group of rows that have the same fixed values and differ in a cell."""
    groups: dict[_Fixed, list[Trial]] = {}
    for row in rows:
        groups.setdefault(fixed(row), []).append(row)
    tables = {key: cells_of(group) for key, group in groups.items()}
    tables = {key: cells for key, cells in tables.items() if len(cells) > 1}
    for key, cells in tables.items():
        told = ", ".join(f"{name} = {value:g}" for name, value in key)
        title = f"{general} ({told})" if len(tables) > 1 else general
        yield RecordedTable(policy=policy, title=title, cells=cells)


def _all_but(varied: str | None) -> Callable[[Trial], _Fixed]:
    """Return what gives a row's size and parameters, but for the one that is varied."""
    return lambda row: (
        ("N", float(row.n_robots or 0)),
        *(pair for pair in row.parameters if pair[0] != varied),
    )


def _size_cells(group: Sequence[Trial]) -> _Cells:
    scenarios = {scenario.n_robots: scenario for scenario in map(_scenario, group)}
    return tuple(
        RecordedCell(kind="size", name="n_robots", value=n, scenario=scenarios[n])
        for n in sorted(scenarios)
    )


def _fault_cells(file: Path, group: Sequence[Trial]) -> _Cells:
    broken = next((row for row in group if row.faulty), None)
    if broken is None:
        return ()
    if not any(row.fault == NO_FAULT for row in group):
        raise StudyError(
            f"{file}, line {broken.line}: has the fault {broken.fault!r}, but no row without "
            "one (fault none) of the same robots and parameters: R and FT are relative to it"
        )
    cells = [_fault_cell(row) for row in group]
    # What faults are measured against stands first, then the pair that shows chance alone.
    cells.sort(key=lambda cell: (cell.fault is not None, cell.repeated))
    return tuple(dict.fromkeys(cells))


def _fault_cell(row: Trial) -> RecordedCell:
    fault = None
    if row.faulty:
        fault = RecordedFault(mode=row.fault, robots=row.faulty, onset=row.onset)
    return RecordedCell(
        kind="fault",
        name=row.fault,
        value=row.faulty,
        onset=row.onset,
        scenario=_scenario(row),
        fault=fault,
        repeated=row.fault == REPEATED,
    )


def _parameter_cells(file: Path, name: str, x_o: float, group: Sequence[Trial]) -> _Cells:
    by_value = {dict(row.parameters)[name]: row for row in group}
    values = sorted(by_value, key=lambda x: x != x_o)  # a stable sort: x_o, then as in the file
    if values[0] == 0.0 and len(values) > 1:
        raise StudyError(
            f"{file}, line {by_value[0.0].line}: {name} = 0 is x_o, as in the first row, "
            "and A is relative to x_o: let a row with another value stand first"
        )
    return tuple(
        RecordedCell(kind="parameter", name=name, value=value, scenario=_scenario(by_value[value]))
        for value in values
    )


def _refuse_unused(file: Path, rows: Sequence[Trial], used: Iterable[Sequence[Trial]]) -> None:
    compared = {row.line for found in used for row in found}
    for row in rows:
        if row.line not in compared:
            varied = ", ".join(repr(name) for name, _ in row.parameters)
            hint = f"; columns taken for parameters: {varied}" if varied else ""
            raise StudyError(
                f"{file}, line {row.line}: stands alone: should differ from some other row in the "
                f"fault, the number of robots or one parameter alone{hint}"
            )
