"""Plan: the conditions and comparisons that follow from a specification, shared ones once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, pairwise, product

from more_itertools import map_reduce

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.spi.definitions import comparing
from swarm_logistics_env.study.tasks.task import Case, Fields, Run, TaskFault, TaskScenario
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.trials import Trial

from .comparison import (
    NO_FAULT,
    OTHER_BEHAVIOUR,
    Arm,
    Comparison,
    Setting,
    between_policies,
    compared,
)
from .specification import BOTH, Ablation, Factor, Faults, Parameter, Sizes, Specification

SUPERLINEAR = 1.0  # threshold of S for the steps in `Sizes.superlinear`
CellKey = tuple[str, str, Arm]  # label of the policy, table, arm


class Origin(Record):
    """The source of recorded trials.

    Attributes:
        file: its name.
        digest: of its content.
        paired: whether its rows name their seeds.
        seeds: those that they name, ascending; empty: none.
        setup: what the user states about the trials, name and value.
        trials: one of every condition, in the order of their policies and conditions.
        notes: sentences on how the file was read.
        performance: what the file calls P, with its unit where it names one.
        references: table, parameter and its value that A is relative to, where it is settled.
        blocks: the names of the blocks that the seeds number; none where the file numbers them.
    """

    error_type = StudyError

    file: str
    digest: str
    paired: bool
    seeds: tuple[int, ...] = ()
    setup: tuple[tuple[str, str], ...] = ()
    trials: tuple[Trial, ...] = ()
    notes: tuple[str, ...] = ()
    performance: str = "P"
    references: tuple[tuple[str, str, float], ...] = ()
    blocks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """The runs and the comparisons of a study.

    Attributes:
        specification: the specification that it was made from.
        comparisons: all comparisons, in the order of the report.
        code: the version of the code that decides the result of a run.
        identities: the identities of the policies, by their names in the specification.
        nulls: by table and original arm, an arm without fault that shares the worlds of the
            original one, not its behaviour: what chance alone makes of the two. For faults that
            begin during the run.
        origin: of imported results; None: they are run here.
    """

    specification: Specification
    comparisons: tuple[Comparison, ...]
    code: str
    identities: Mapping[str, str]
    nulls: Mapping[tuple[str, Arm], Arm] = field(default_factory=dict)
    origin: Origin | None = None

    @property
    def paired(self) -> bool:
        """Whether all conditions share their seeds."""
        return self.origin is None or self.origin.paired

    @property
    def seeds(self) -> Sequence[int]:
        """The seeds of every condition, ascending."""
        named = self.origin.seeds if self.origin else ()
        return named or self.specification.seed_numbers

    @cached_property
    def cells(self) -> tuple[CellKey, ...]:
        """The key of every cell that the report shows, those of a factor together."""
        cells = [
            (comparison.policy, comparison.table, arm)
            for comparison in self.comparisons
            for arm in comparison.arms
        ]
        cells += [(null.case.policy.title, table, null) for (table, _), null in self.nulls.items()]
        by_factor: dict[tuple[str, str, str], list[CellKey]] = map_reduce(
            cells, lambda cell: (cell[0], cell[1], cell[2].setting.name)
        )
        return tuple(dict.fromkeys(chain.from_iterable(by_factor.values())))

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """The conditions to run, each once however many comparisons share it."""
        every = (case for _, _, arm in self.cells for case in arm.case.trainings)
        return tuple({case.key: case for case in every}.values())

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """Every run, seed by seed, so that an interrupted study has complete seeds."""
        return tuple(Run(case, self.code, seed) for seed in self.seeds for case in self.cases)

    @property
    def name_of_p(self) -> str:
        """P with what the file of recorded trials calls it, e.g. "P (throughput)"."""
        if self.origin is None:
            performance = self.specification.performance
            return f"P ({performance})" if performance else "P"
        if self.origin.performance == "P":
            return "P"
        return f"P ({self.origin.performance})"

    @property
    def what_p_is(self) -> str:
        """What the performance P is, e.g. "the number of items delivered"."""
        if self.origin is None:
            performance = self.specification.performance
            return performance.words if performance else self.specification.played.performance
        return f"{self.origin.performance!r} of {self.origin.file}"

    @property
    def unusual_engine(self) -> str:
        """What moves the bodies; empty: what usually does in this task."""
        task = self.specification.played
        world = world_of(task)
        engine = world.engine(self.specification.scenario)
        return "" if engine == world.engine(task.default) else engine

    def __str__(self) -> str:
        n_cases = len(self.cases)
        n_questions = len(self.comparisons)
        questions = "1 question" if n_questions == 1 else f"{n_questions} questions"
        start = self.specification.first_seed
        first = f" from {start} on" if start else ""
        most = "at most " if self.specification.until_clear else ""
        return (
            f"{self.specification.name}: {questions}; {n_cases} conditions x "
            f"{most}{len(self.seeds)} seeds{first} = {most}{n_cases * len(self.seeds)} runs"
        )


def make_plan(
    specification: Specification,
    *,
    code: str | None = None,
    identities: Mapping[str, str] | None = None,
) -> Plan:
    """Return the plan of a study.

    Args:
        code: version of the code that played it; None: that of this process.
        identities: of its policies when it was played; None: they are loaded, and say so.

    Raises:
        StudyError: the specification varies nothing, a step of it cannot be, or a policy of several
            trainings is to be played until it is clear.
        ScenarioError, FaultError, PolicyError: a condition that cannot be built.
    """
    task = specification.played
    several = [policy.name for policy in specification.policies if policy.trainings]
    if several and specification.until_clear:
        raise StudyError(
            f"policies = {several}: several trainings have a fixed number of seeds; should be "
            "until_clear = false (--all-seeds)"
        )

    parts = {f"policy {policy.title}": policy for policy in specification.policies}
    for number, ablation in enumerate(specification.ablations, start=1):
        parts[f"ablation {number}"] = ablation.policy
    if identities is None:
        identities = {part: policy.identity(task.policies) for part, policy in parts.items()}
    if unknown := [part for part in parts if part not in identities]:
        raise StudyError(f"the study does not know the identity of its {unknown[0]}")
    cases = [
        Case(
            policy,
            identities[part],
            specification.scenario,
            task=task,
            performance=specification.performance,
        )
        for part, policy in parts.items()
    ]
    wanted = [
        comparison
        for comparison in _comparisons(specification, cases)
        if comparison.indicator in specification.indicators
    ]
    if specification.compares_policies:
        wanted += between_policies(wanted)
    # What two factors compare alike is compared once, or Holm's family would count it twice.
    comparisons = tuple(dict.fromkeys(wanted))
    if not comparisons:
        raise StudyError(
            "the study compares nothing: give sizes, faults, parameters or ablations, and the "
            "indicators that judge them"
        )
    if specification.performance:
        for arm in dict.fromkeys(arm for comparison in comparisons for arm in comparison.arms):
            specification.performance.refuse_unmeasured(arm.case.scenario)
    # Only comparisons with the robots removed have a time to come back, which needs the null.
    nulls = {
        (comparison.table, comparison.original): Arm(
            OTHER_BEHAVIOUR, replace(comparison.original.case, behaviour=1)
        )
        for comparison in comparisons
        if comparison.removed and comparison.changed.setting.onset
    }
    return Plan(specification, comparisons, code or task.code(), identities, nulls)


def refuse_changed_policies(plan: Plan, runs: Iterable[Run]) -> None:
    """Raise PolicyError if a policy is not the one any more that was planned.

    Args:
        runs: that will be played. An object may have learned also where none is missing.
    """
    cases = [case for case in plan.cases if case.policy.made is not None]
    cases += [run.case for run in runs]
    for case in {(case.policy, case.identity): case for case in cases}.values():
        case.policy.refuse_other(case.identity, case.task.policies)


def _comparisons(specification: Specification, cases: Sequence[Case]) -> Iterator[Comparison]:
    """Yield all comparisons; `cases` are those of the policies, then those of the ablations."""
    n_policies = len(specification.policies)
    for base in cases[:n_policies]:
        for sizes in specification.sizes:
            yield from _scalability(sizes, base)
        for faults in specification.faults:
            yield from _robustness(faults, base, specification.indicators)
        for parameter in specification.parameters:
            yield from _adaptability(parameter, base)
        for ablation, ablated in zip(specification.ablations, cases[n_policies:]):
            if ablated.identity != base.identity:
                yield from _ablation(ablation, base, ablated)


def _title(factor: Factor, general: str, manner: str = "") -> str:
    changes = [*filter(None, [manner]), *(f"{name} = {x}" for name, x in factor.scenario.items())]
    return factor.title or (f"{general} ({', '.join(changes)})" if changes else general)


def _arm(base: Case, setting: Setting, changes: Fields, *faults: TaskFault) -> Arm:
    scenario = base.task.vary(base.scenario, changes)
    world_of(base.task).check_faults(scenario, faults)
    return Arm(setting, replace(base, scenario=scenario, faults=faults))


def _scalability(sizes: Sizes, base: Case) -> Iterator[Comparison]:
    """Yield the comparisons between neighbouring swarm sizes."""
    table = _title(sizes, "Scalability")
    arms = {
        n: _arm(base, Setting("size", "n_robots", n), {**sizes.scenario, "n_robots": n})
        for n in sizes.values
    }
    yield from compared(table, list(arms.values()))
    for small, large in sizes.superlinear:
        if (small, large) not in pairwise(sizes.values):
            raise StudyError(
                f"superlinear = ({small}, {large}): should be a step between neighbouring "
                f"sizes of {sizes.values}"
            )
        yield Comparison(table, "S", arms[small], arms[large], threshold=SUPERLINEAR)


def _robustness(faults: Faults, base: Case, indicators: Collection[str]) -> Iterator[Comparison]:
    """Yield the indicators of every mode, m and onset.

    An indicator that needs robots removed is left out where the task cannot remove any.
    """
    task, table = base.task, _title(faults, "Fault tolerance and robustness", str(faults))
    original = _arm(base, NO_FAULT, faults.scenario)
    most = max(faults.robots)
    latest = max(faults.onsets)
    fields = "faults.robots", "faults.onsets"
    _refuse_impossible_fault(original.case.scenario, most, latest, fields)

    def arm(mode: str, m: int, onset: float, lasts: float | None, manner: Fields) -> Arm:
        failing = [task.fault(name, m, onset, lasts, manner) for name in mode.split(BOTH)]
        return _arm(base, Setting("fault", mode, m, onset), faults.scenario, *failing)

    arms = [original]
    for onset, mode, m in product(faults.onsets, faults.modes, faults.robots):
        arms.append(arm(mode, m, onset, faults.duration, faults.manner))
    # Some tasks cannot remove robots in mid-run, and need not where nobody asks.
    wanted = [definition for definition in comparing("fault") if definition.symbol in indicators]
    if task.removed is not None and any(definition.needs_removed for definition in wanted):
        # The robots that are removed are those that would have failed.
        whom = {name: x for name, x in faults.manner.items() if name in ("role", "kind")}
        for onset, m in product(faults.onsets, faults.robots):
            arms.append(arm(task.removed, m, onset, None, whom))
    yield from compared(table, arms)


def _refuse_impossible_fault(
    scenario: TaskScenario, robots: int, onset: float, fields: tuple[str, str]
) -> None:
    """Raise StudyError, which names these fields, if no robot would be left or none would fail."""
    if robots >= scenario.n_robots:
        raise StudyError(
            f"{fields[0]} = {robots}: should be less than n_robots = {scenario.n_robots}, or no "
            "working robot is left"
        )
    if onset >= scenario.duration:
        raise StudyError(
            f"{fields[1]} = {onset:g} s: should be less than duration = "
            f"{scenario.duration:g} s, or nothing fails"
        )


def _adaptability(parameter: Parameter, base: Case) -> Iterator[Comparison]:
    """Yield the comparisons of a parameter's first value with each other one."""
    name = parameter.name
    table = _title(parameter, f"Adaptability to {name}")
    arms = [
        _arm(base, Setting("parameter", name, x), {**parameter.scenario, name: x})
        for x in parameter.values
    ]
    yield from compared(table, arms)


def _ablation(ablation: Ablation, base: Case, ablated: Case) -> Iterator[Comparison]:
    task = base.task
    table = _title(ablation, "Ablation")
    scenario = task.vary(base.scenario, ablation.scenario)
    faults: list[TaskFault] = []
    if ablation.mode:
        fields = "ablations.robots", "ablations.onset"
        _refuse_impossible_fault(scenario, ablation.robots, ablation.onset, fields)
        faults = [
            task.fault(name, ablation.robots, ablation.onset, None, {})
            for name in ablation.mode.split(BOTH)
        ]
    original, changed = (
        _arm(
            case,
            Setting("policy", case.policy.title, scenario.n_robots),
            ablation.scenario,
            *faults,
        )
        for case in (base, ablated)
    )
    # "P falls by more than a share" is the opposite of "the change is above minus that share".
    threshold = -ablation.fall if ablation.fall else 0.0
    for definition in comparing("policy"):
        yield Comparison(
            table, definition.symbol, original, changed, threshold=threshold, claim=False
        )
