"""Specification: what a study asks, as one validated record, and as a TOML file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    NonNegativeFloat,
    PlainSerializer,
    PositiveFloat,
    PositiveInt,
    SkipValidation,
    ValidationInfo,
    field_validator,
    model_validator,
)

from swarm_logistics_env.core.errors import StudyError, SwarmLogisticsError, suggest
from swarm_logistics_env.core.records import FileName, Record, each_of, file_name, read_table
from swarm_logistics_env.policies.catalogue import display_name
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.spi.equivalence import MARGIN
from swarm_logistics_env.study.tasks.performance import Performance
from swarm_logistics_env.study.tasks.task import (
    DEFAULT,
    Task,
    TaskScenario,
    refuse_untrusted,
    task_of,
)

FieldTable = dict[str, JsonValue]
BOTH = "+"  # between failure modes that the same robots have at once
# More than anybody plays: a slip of a digit is refused before it fills the memory with runs.
MOST_SEEDS = 100_000
# Every seed stays below 2**31: policies hand it to generators of all kinds.
HIGHEST_FIRST_SEED = 2**31 - MOST_SEEDS
# A first look at 10 errs no more often than one at 20: `verification/verdict_errors.py`.
FIRST_LOOK = 10
SEEDS_BETWEEN_LOOKS = 10


def _with_distinct_labels(policies: tuple[PolicySpec, ...]) -> tuple[PolicySpec, ...]:
    """Return policies; files with the same name on their cards are called by their paths."""
    counts = Counter(policy.title for policy in policies)
    labelled = tuple(
        policy.replace(label=policy.name)
        if counts[policy.label] > 1 and policy.label == display_name(policy.name)
        else policy
        for policy in policies
    )
    for title, count in Counter(policy.title for policy in labelled).items():
        if count > 1:
            raise ValueError(f"policy {title!r} is given twice")
    return labelled


PolicySource = Annotated[PolicySpec, BeforeValidator(PolicySpec.of)]
# A task's name, its import path or, in Python, the task itself; the scenario's validator finds it.
TaskSource = Annotated[
    str | Task,
    SkipValidation,
    PlainSerializer(lambda source: source if isinstance(source, str) else source.name),
]


class Factor(Record):
    """A factor that a study varies, and the scenario in which it is varied.

    Args:
        title: the heading in the report; an empty one is made from the factor.
        scenario: fields that differ from the study's base scenario.
    """

    error_type = StudyError

    title: str = ""
    scenario: FieldTable = Field(default_factory=dict)


def _ascending(values: tuple[int, ...]) -> tuple[int, ...]:
    if list(values) != sorted(set(values)):
        raise ValueError("should be ascending, each size once")
    return values


FactorT = TypeVar("FactorT", bound=Factor)


class Sizes(Factor):
    """Swarm sizes N, ascending; every step from one to the next gives a scalability S.

    Args:
        values: the swarm sizes [robots].
        superlinear: steps (N, N + m) that are also tested for S > 1.
    """

    values: Annotated[tuple[PositiveInt, ...], Field(min_length=2), AfterValidator(_ascending)]
    superlinear: tuple[tuple[PositiveInt, PositiveInt], ...] = ()


class Faults(Factor):
    """Failure modes, numbers of faulty robots and onsets; all combinations give FT and R.

    Args:
        modes: failure modes of the task other than "removed", which is the reference P_S: there the
            robots are removed for good. "FM1+FM4": the same robots fail in both ways.
        robots: numbers m of faulty robots, each below the swarm size.
        onsets: the times at which robots fail [s].
        duration: how long a failure lasts [s]; without it, until the end of the episode.
        factor: the share of speed or view that `motor_slow`, `motor_wear` and `view_reduced` leave,
            in [0, 1); without it, the mode's own.
        intermittent: for how long [s] a failure holds, and for how long not, both on average, in
            turn: random failure and repair; without it, it holds without a break.
        role: which robots fail: those that do this at the onset, of `world.warehouse.faults.ROLES`;
            without it, they are drawn.
        kind: which robots fail: drawn from those of this kind of the scenario's `robot_kinds`.
    """

    modes: Annotated[tuple[str, ...], Field(min_length=1)]
    robots: Annotated[tuple[PositiveInt, ...], Field(min_length=1)] = (1, 2, 3)
    onsets: Annotated[tuple[NonNegativeFloat, ...], Field(min_length=1)] = (0.0,)
    duration: PositiveFloat | None = None
    factor: Annotated[float, Field(ge=0, lt=1)] | None = None
    intermittent: tuple[PositiveFloat, PositiveFloat] | None = None
    role: str | None = None
    kind: str | None = None

    @property
    def manner(self) -> FieldTable:
        """The fields of a fault that say how it fails and whom it strikes, as far as given."""
        return self.model_dump(
            include={"factor", "intermittent", "role", "kind"}, exclude_none=True
        )

    def __str__(self) -> str:
        """Return in words how long, how far and how steadily robots fail; empty: for good."""
        parts = [] if self.duration is None else [f"for {self.duration:g} s"]
        parts += [] if self.factor is None else [f"factor {self.factor:g}"]
        if self.intermittent is not None:
            held, paused = self.intermittent
            parts.append(f"{held:g} s failed, {paused:g} s not, in turn")
        parts += [] if self.role is None else [f"role {self.role}"]
        parts += [] if self.kind is None else [f"kind {self.kind}"]
        return ", ".join(parts)


def _from_above_0(values: tuple[float, ...]) -> tuple[float, ...]:
    if values[0] == 0.0 or values[0] in values[1:]:
        raise ValueError("should start with x_o above 0 and not repeat it: A is relative to it")
    return values


class Parameter(Factor):
    """Values of one field of the scenario; the change from the first to each other gives an A.

    Args:
        name: a numeric field of the task's scenario.
        values: first x_o, which is above 0, then every x_new, in the field's unit.
    """

    name: str
    values: Annotated[
        tuple[NonNegativeFloat, ...], Field(min_length=2), AfterValidator(_from_above_0)
    ]


class Ablation(Factor):
    """A second policy that lacks a part of the studied one, to test whether P falls without it.

    Args:
        policy: the policy without the part.
        fall: the claim is that P falls by more than this share of P, in [0, 1).
        mode: failure mode of some robots under both policies, as in `Faults`; empty: none fails.
        robots: number of these robots, below the swarm size.
        onset: when they fail [s].
    """

    policy: PolicySource
    fall: Annotated[float, Field(ge=0, lt=1)] = 0.0
    mode: str = ""
    robots: PositiveInt = 1
    onset: NonNegativeFloat = 0.0


def text_if_any(performance: Performance | str | None) -> str | None:
    """Return a performance as a text; None stays None."""
    return None if performance is None else str(performance)


class Specification(Record):
    """All that a study asks: which policies, under which conditions, over how many seeds.

    Args:
        name: the study's name, of which its directory is called: at most 80 letters, digits, -, _
            and, within, points.
        task: the task to play: "warehouse", another name that the package knows, or the import path
            "package.module:OBJECT" of a `study.tasks.Task`; in Python also the task itself.
        policies: names, paths, tables {name, parameters, label}, or objects with `reset` and
            `act`.
        seeds: number of seeds, the same for every condition.
        first_seed: the smallest seed, 0 or more; the others follow it one by one.
        scenario: the base scenario, as a table of the fields in which it differs from the task's
            default; "preset" is a field of the warehouse.
        sizes, faults, parameters, ablations: the factors that the study varies.
        compares_policies: whether P of each policy is compared with that of the first one, in all
            conditions that indicators need; of a failure mode in that with the most robots.
        indicators: the indicators to test; conditions that only others need are not run.
        until_clear: whether the study is looked at after 10, 20, .. up to `seeds` seeds, and each
            comparison stops where its verdict is clear under Holm; only the conditions that open
            ones need are played further. The error over all looks stays at 5 %.
        performance: what P of a run is, as "on_time" or "p95_tardiness:60" (`Performance`); None:
            what the task counts. Runs are the same, so that they can be judged by another one, too.
        margin: the largest change of P that counts as none, as a share of P_o, in (0, 1); every R,
            FT and A is tested for it as well.
        reference: published results, which the report shows beside those of the study.

    Raises:
        StudyError: a field is unknown, or its value is not allowed; the message names each.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)
    error_type = StudyError

    name: FileName = "study"
    task: TaskSource = DEFAULT
    policies: Annotated[
        tuple[PolicySource, ...], Field(min_length=1), AfterValidator(_with_distinct_labels)
    ] = (PolicySpec(name="swarm-dt"),)
    seeds: Annotated[int, Field(gt=0, le=MOST_SEEDS)] = 20
    first_seed: Annotated[int, Field(ge=0, le=HIGHEST_FIRST_SEED)] = 0
    scenario: Annotated[TaskScenario, SkipValidation] = Field(default={}, validate_default=True)
    sizes: Annotated[tuple[Sizes, ...], BeforeValidator(each_of(Sizes))] = ()
    faults: Annotated[tuple[Faults, ...], BeforeValidator(each_of(Faults))] = ()
    parameters: Annotated[tuple[Parameter, ...], BeforeValidator(each_of(Parameter))] = ()
    ablations: Annotated[tuple[Ablation, ...], BeforeValidator(each_of(Ablation))] = ()
    compares_policies: bool = False
    indicators: Annotated[tuple[str, ...], Field(min_length=1)] = tuple(DEFINITIONS)
    until_clear: bool = False
    performance: Annotated[
        Performance | None, BeforeValidator(Performance.of), PlainSerializer(text_if_any)
    ] = None
    margin: Annotated[float, Field(gt=0, lt=1)] = MARGIN
    reference: Literal["paper"] | None = None

    @property
    def seed_numbers(self) -> range:
        """The seeds of every condition."""
        return range(self.first_seed, self.first_seed + self.seeds)

    @property
    def looks(self) -> tuple[int, ...]:
        """The numbers of seeds at which comparisons may stop; none without `until_clear`."""
        return looks_up_to(self.seeds) if self.until_clear else ()

    @property
    def played(self) -> Task:
        """The task itself."""
        return task_of(self.task)

    def trusting(self) -> Self:
        """Return the specification with policies that may be files which run code."""
        policies = (policy.replace(trusted=True) for policy in self.policies)
        ablations = (
            ablation.replace(policy=ablation.policy.replace(trusted=True))
            for ablation in self.ablations
        )
        return self.replace(policies=tuple(policies), ablations=tuple(ablations))

    def varying(self, fields: Mapping[str, Any]) -> Self:
        """Return the specification with fields of its scenario changed in every condition.

        Raises:
            SwarmLogisticsError: a field is unknown or cannot be.
        """

        def vary_all(factors: Iterable[FactorT]) -> tuple[FactorT, ...]:
            # A table that starts from a preset of its own does not have the fields of the base.
            return tuple(
                factor.replace(scenario={**factor.scenario, **fields})
                if "preset" in factor.scenario
                else factor
                for factor in factors
            )

        return self.replace(
            scenario=self.played.vary(self.scenario, fields),
            sizes=vary_all(self.sizes),
            faults=vary_all(self.faults),
            parameters=vary_all(self.parameters),
            ablations=vary_all(self.ablations),
        )

    @field_validator("scenario", mode="before")
    @classmethod
    def _of_the_task(cls, value: object, info: ValidationInfo) -> object:
        task = task_of(info.data["task"])
        if isinstance(value, dict):
            return task.vary(task.default, value)
        if not isinstance(value, type(task.default)):
            raise ValueError(f"should be a table of fields or a {type(task.default).__name__}")
        return value

    @model_validator(mode="after")
    def _names_are_known(self) -> Self:
        task = self.played
        parameters = [factor.name for factor in self.parameters]
        combined = [modes for factor in self.faults for modes in factor.modes]
        combined += [ablation.mode for ablation in self.ablations if ablation.mode]
        modes = (mode for modes in combined for mode in modes.split(BOTH))
        _refuse_unknown("failure mode", modes, {*task.failure_modes} - {task.removed})
        if "n_robots" in parameters:
            raise ValueError("swarm sizes belong in `sizes`, where S judges them")
        _refuse_unknown("numeric scenario field", parameters, task.fields)
        _refuse_unknown("indicator", self.indicators, DEFINITIONS)
        return self


def _refuse_unknown(what: str, names: Iterable[str], allowed: Collection[str]) -> None:
    for name in names:
        if name not in allowed:
            raise ValueError(f"no {what} {name!r}{suggest(name, allowed)}")


def looks_up_to(most: int) -> tuple[int, ...]:
    """Return the looks of a study of at most so many seeds; the last is at `most`."""
    return (*range(FIRST_LOOK, most, SEEDS_BETWEEN_LOOKS), most)


def read_study_file(path: Path, *, trust_code: bool = False) -> Specification:
    """Return the specification in a TOML file, named after the file where it has no name.

    Example of a file:
        policies = ["swarm-dt", { name = "swarm-dt", parameters = { taxis_gain = 0.5 } }]
        seeds = 20
        scenario = { preset = "paper", duration = 300 }

        [[faults]]
        modes = ["FM1", "FM4"]
        robots = [1, 2]

        [[parameters]]
        name = "delivery_width"
        values = [2.0, 1.0]

    Args:
        trust_code: whether its task and its policies may be code ("package.module:Class", or a file
            of stable-baselines3), which runs when it is loaded.

    Raises:
        StudyError: the file cannot be read, is not TOML, names code that it may not, or a field of
            it is unknown or cannot be.
    """
    fields = read_table(path, "study file", StudyError)
    refuse_untrusted(path, fields.get("task"), trust_code=trust_code)
    try:
        specification = Specification(**{"name": file_name(path.stem), **fields})
    except SwarmLogisticsError as error:  # whichever record of it refuses
        raise StudyError(f"{path}: {error}") from error
    named = (*specification.policies, *(ablation.policy for ablation in specification.ablations))
    factors = (*specification.sizes, *specification.faults, *specification.parameters)
    scenarios = [specification.scenario.model_dump(), *(factor.scenario for factor in factors)]
    bodies = [fields["bodies"] for fields in scenarios if "bodies" in fields]
    refuse_untrusted(path, None, named, bodies, trust_code=trust_code)
    return specification.trusting() if trust_code else specification


def seeds_in_words(seeds: Sequence[int]) -> str:
    """Return ascending seeds as ranges, e.g. "0 to 3, 8"; at least one."""
    breaks = [index for index, (a, b) in enumerate(pairwise(seeds), start=1) if b != a + 1]
    parts = [seeds[a:b] for a, b in pairwise([0, *breaks, len(seeds)])]
    return ", ".join(f"{p[0]}" if len(p) == 1 else f"{p[0]} to {p[-1]}" for p in parts)
