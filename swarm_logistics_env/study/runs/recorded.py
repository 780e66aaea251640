"""Trials recorded elsewhere (real robots, another lab, a paper) made a study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from shlex import quote
from typing import Self

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.records import file_name
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.questions.comparison import (
    OTHER_BEHAVIOUR,
    Arm,
    Setting,
    between_policies,
    compared,
)
from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.plan import Origin, Plan
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Outcomes, Run
from swarm_logistics_env.study.tasks.warehouse_task import RECORDED, RecordedFault, RecordedScenario
from swarm_logistics_env.study.trials import NO_FAULT_WORD, REPEATED, Trial, Trials

from .notes import note
from .store import Runs


@dataclass(frozen=True)
class RecordedStudy:
    """A study of trials that somebody else recorded.

    Attributes:
        plan: what can be compared in them; there is nothing to play.
        outcomes: of the trials, by the key of the case and the seed.
    """

    plan: Plan
    outcomes: Outcomes

    @classmethod
    def of(cls, trials: Trials, setup: Mapping[str, str] | None = None) -> Self:
        """Return the study of the trials in a file (`study.read_trials`).

        Swarm sizes without fault, failure modes and the values of each parameter become a table
        each; the values of everything else that the file varies make tables of their own. A
        parameter's x_o is the one that `Trials.references` names. With seeds the study is paired,
        else it is not. The order of the file's rows decides nothing.

        Args:
            setup: name and value of what the report is to say of the conditions.

        Raises:
            StudyError: a trial stands alone, nothing that it can be relative to is there, or
                nothing settles which value of a parameter A is relative to.
        """
        conditions = _conditions(trials)
        origin = _origin(trials, conditions, setup)
        specification = Specification(
            name=file_name(Path(trials.file).stem),
            task=RECORDED.name,
            policies=tuple(
                PolicySpec(name=name) for name in dict.fromkeys(row.policy for row in origin.trials)
            ),
            seeds=max(map(len, conditions)),
        )
        try:
            plan = imported_plan(specification, origin)
            _refuse_unused(origin, plan)
        except StudyError as error:
            raise StudyError(f"{trials.file}, {error}") from None
        return cls(plan, _outcomes(conditions, origin))

    def keep(self, directory: Path) -> None:
        """Write the study into a directory, for `Study.stored`.

        Raises:
            StudyError: it holds another study, or cannot be written.
        """
        with Runs.new(directory, "import") as runs:
            runs.add(self._runs())
            note(runs, self.plan, Declaration.model_validate(self.plan.specification))

    def _runs(self) -> Iterator[tuple[Run, Outcome]]:
        """Yield the run and the outcome of each trial, and show how many are written."""
        cases = {case.key: case for case in self.plan.cases}
        with ProgressBar("import", len(self.outcomes), "trials") as progress:
            for n_done, ((key, seed), outcome) in enumerate(self.outcomes.items(), start=1):
                yield Run(cases[key], self.plan.code, seed), outcome
                if n_done % _PROGRESS_EVERY == 0:
                    progress.reach(n_done)


_PROGRESS_EVERY = 10_000  # trials


def _outcomes(conditions: Iterable[Sequence[Trial]], origin: Origin) -> Outcomes:
    """Return the outcome of each trial by the key of its case and its seed, or else its number."""
    outcomes = {}
    for trials in conditions:
        key = _case(origin, trials[0]).key
        for number, trial in enumerate(trials):
            seed = number if trial.seed is None else trial.seed
            outcomes[key, seed] = _outcome(trial)
    return outcomes


def _origin(
    trials: Trials, conditions: Iterable[Sequence[Trial]], setup: Mapping[str, str] | None
) -> Origin:
    """Return what a study of trials notes of their source: equal ones are the same study."""
    return Origin(
        file=trials.file,
        digest=trials.digest,
        paired=trials.paired,
        seeds=tuple(sorted({row.seed for row in trials.rows if row.seed is not None})),
        setup=tuple((setup or {}).items()),
        trials=tuple(map(_named, conditions)),
        notes=notes_on(trials),
        performance=trials.performance_name,
        references=trials.references,
        blocks=trials.blocks,
    )


def notes_on(trials: Trials) -> tuple[str, ...]:
    """Return sentences on how trials were read, and on what is not asked of them."""
    return (*trials.notes, *_without_removed(trials))


def _conditions(trials: Trials) -> list[list[Trial]]:
    """Return the trials of each condition, both in an order that is not the file's."""
    by_condition: dict[tuple[object, ...], list[Trial]] = map_reduce(
        sorted(trials.rows, key=_order), lambda row: row.condition
    )
    return [*by_condition.values()]


def _order(row: Trial) -> tuple[object, ...]:
    condition = row.n_robots or 0, row.parameters, row.fault, row.faulty, row.onset
    measured = row.performance, row.times or (), row.contacts or 0.0, row.duration or 0.0
    return (row.policy.casefold(), row.policy, row.table, *condition, row.seed or 0, *measured)


def _named(trials: Sequence[Trial]) -> Trial:
    """Return what a condition is, with its first line and the most trials that a block has."""
    line = min(row.line for row in trials)
    n_trials = max(row.n_trials for row in trials)
    return replace(trials[0], line=line, times=None, n_trials=n_trials)


def _without_removed(trials: Trials) -> Iterator[str]:
    """Yield why FT is not asked, where robots failed and none were taken away."""
    faults = {row.fault for row in trials.rows} - {NO_FAULT_WORD, REPEATED}
    if faults and RECORDED.removed not in faults:
        yield (
            f"No FT: it needs trials without the robots, fault = {RECORDED.removed}, robots as "
            "before they were taken away; R is asked."
        )


def imported_plan(specification: Specification, origin: Origin) -> Plan:
    """Return the plan of recorded trials: what can be compared in them, and nothing to play.

    Raises:
        StudyError: something has nothing that it can be relative to.
    """
    tables = [
        (title, [Arm(setting, _case(origin, row)) for setting, row in rows])
        for title, rows in _tables(origin)
    ]
    comparisons = [comparison for title, arms in tables for comparison in compared(title, arms)]
    # Of more policies nobody says which one is the reference.
    if comparisons and len(specification.policies) == 2:
        comparisons += between_policies(comparisons)
    return Plan(
        specification,
        tuple(comparisons),
        RECORDED.code(),
        {},
        nulls={
            (title, arms[0]): arm
            for title, arms in tables
            for arm in arms[1:]
            if arm.setting == OTHER_BEHAVIOUR
        },
        origin=origin,
    )


def _case(origin: Origin, row: Trial) -> Case:
    identity = f"{row.policy}: {origin.file} ({origin.digest})"
    scenario = RecordedScenario(
        n_robots=row.n_robots or 0,
        duration=row.duration or 0.0,
        table=row.table,
        parameters=row.parameters,
    )
    fault = RecordedFault(mode=row.fault, robots=row.faulty, onset=row.onset)
    policy = PolicySpec(name=row.policy)
    behaviour = int(row.fault == REPEATED)
    faults = (fault,) if row.faulty else ()
    return Case(policy, identity, scenario, faults, behaviour, task=RECORDED)


@lru_cache(10_000)  # many trials have the same P
def _untimed(performance: float, least: float | None, contacts: float | None) -> Outcome:
    return Outcome(untimed=performance, least=least, contacts_per_robot_minute=contacts)


def _outcome(row: Trial) -> Outcome:
    if row.times is None:
        return _untimed(row.performance, row.least, row.contacts)
    return Outcome(
        delivery_times=np.array(row.times),
        ended_at=row.duration or 0.0,
        contacts_per_robot_minute=row.contacts,
    )


_Varied = list[tuple[Setting, Trial]]  # the rows of a table, the original condition first
_Fixed = tuple[tuple[str, float], ...]  # name and value of what is the same in a table


def _tables(origin: Origin) -> Iterator[tuple[str, _Varied]]:
    """Yield what can be compared: all trials that differ in one thing alone, for each thing.

    Yields:
        The heading in the report, and the rows with what each has of that thing.
    """
    references = {(table, name): x_o for table, name, x_o in origin.references}
    by_table: dict[tuple[str, str], list[Trial]] = map_reduce(
        origin.trials, lambda row: (row.policy, row.table)
    )
    for (_, table), rows in by_table.items():
        plain = [row for row in rows if row.fault == NO_FAULT_WORD]
        sized = [row for row in plain if row.n_robots is not None]
        of = f"{table}: " if table else ""
        yield from _split(f"{of}Scalability", sized, lambda row: row.parameters, _sizes)
        yield from _split(f"{of}Fault tolerance and robustness", rows, _all_but(None), _faults)
        for name in dict.fromkeys(name for row in plain for name, _ in row.parameters):
            values = partial(_values, name, references.get((table, name)))
            yield from _split(f"{of}Adaptability to {name}", plain, _all_but(name), values)


def _split(
    general: str,
    rows: Sequence[Trial],
    fixed: Callable[[Trial], _Fixed],
    varied: Callable[[Sequence[Trial]], _Varied],
) -> Iterator[tuple[str, _Varied]]:
    """Yield a table for each group of rows that have the same fixed values and differ otherwise."""
    tables_by_values = {key: varied(group) for key, group in map_reduce(rows, fixed).items()}
    tables = {key: table for key, table in tables_by_values.items() if len(table) > 1}
    for key, table in tables.items():
        values_text = ", ".join(f"{name} = {value:g}" for name, value in key)
        yield f"{general} ({values_text})" if len(tables) > 1 else general, table


def _all_but(varied: str | None) -> Callable[[Trial], _Fixed]:
    """Return what gives a row's size and parameters, but for the one that is varied."""
    return lambda row: (
        ("N", float(row.n_robots or 0)),
        *(pair for pair in row.parameters if pair[0] != varied),
    )


def _sizes(group: Sequence[Trial]) -> _Varied:
    rows = sorted(group, key=lambda row: row.n_robots or 0)
    return [(Setting("size", "n_robots", row.n_robots or 0), row) for row in rows]


def _faults(group: Sequence[Trial]) -> _Varied:
    broken = next((row for row in group if row.faulty), None)
    if broken is None:
        return []
    if not any(row.fault == NO_FAULT_WORD for row in group):
        raise StudyError(
            f"line {broken.line}: has the fault {broken.fault!r}, but no row without one (fault "
            "none) of the same robots and parameters: R and FT are relative to it; robots counts "
            "failed and removed ones, too"
        )
    # What faults are measured against stands first, then the pair that shows chance alone.
    rows = sorted(group, key=lambda row: (row.faulty > 0, row.fault == REPEATED))
    return [(Setting("fault", row.fault, row.faulty, row.onset), row) for row in rows]


def _values(name: str, x_o: float | None, group: Sequence[Trial]) -> _Varied:
    by_value = {dict(row.parameters)[name]: row for row in group}
    if len(by_value) == 1:
        return []
    options = [f"--reference {quote(f'{name}={x:g}')}" for x in sorted(by_value) if x]
    line = min(row.line for row in group)
    if x_o is None:
        raise StudyError(
            f"line {line}: A is relative to one value of {name!r}, and no condition "
            "without a fault has more trials than all others: say "
            f"{' or '.join(options)}, or leave it out by --ignore {quote(name)}"
            f"{_work_hint(name, group)}"
        )
    if x_o == 0.0:
        raise StudyError(
            f"line {line}: {name} = 0 is the reference, and A is relative to it: say "
            f"{' or '.join(options)}"
        )
    if x_o not in by_value:
        return []
    values = sorted(by_value, key=lambda x: (x != x_o, x))
    return [(Setting("parameter", name, value), by_value[value]) for value in values]


def _work_hint(name: str, group: Sequence[Trial]) -> str:
    """Return what else to say where a column may count what each run had to do, by its time."""
    is_count = all(dict(row.parameters)[name] % 1.0 == 0.0 for row in group)
    is_one_by_time = all(row.times is None and row.performance < 1.0 for row in group)
    if not (is_count and is_one_by_time):
        return ""
    column = quote(f"work={name}")
    return f"; if it counts what a run had to do, P is that by its time: --column {column}"


def _refuse_unused(origin: Origin, plan: Plan) -> None:
    used = {case.key for case in plan.cases}
    for row in origin.trials:
        if _case(origin, row).key not in used:
            if name := _confounded(origin.trials):
                raise StudyError(
                    f"line {row.line}: the number of robots and {name!r} change together, so what "
                    "comes of either cannot be told: should have trials in which one of them alone "
                    f"differs; --ignore {name} counts what comes of both as the robots'"
                )
            varied = ", ".join(repr(name) for name, _ in row.parameters)
            hint = f"; columns taken for parameters: {varied}" if varied else ""
            settled = ", ".join(f"{name} = {x_o:g}" for _, name, x_o in origin.references)
            hint += f"; references: {settled}" if settled else ""
            raise StudyError(
                f"line {row.line}: stands alone: should differ from some other row in the fault, "
                f"the number of robots or one parameter alone{hint}"
            )


def _confounded(trials: Sequence[Trial]) -> str | None:
    """Return a parameter that every size has a value of its own of; None: there is none."""
    for name, _ in trials[0].parameters:
        pairs = {(row.n_robots, dict(row.parameters)[name]) for row in trials}
        n_sizes, n_values = (len(set(values)) for values in zip(*pairs))
        if n_sizes == n_values == len(pairs) > 1:
            return name
    return None
