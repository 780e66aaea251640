"""Metadata: what a store says of its study besides the runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import Record
from swarm_logistics_env.spi.equivalence import MARGIN
from swarm_logistics_env.studies.runs import seeds_in_words
from swarm_logistics_env.studies.specification import Specification
from swarm_logistics_env.tasks.recorded_trials import Origin
from swarm_logistics_env.tasks.task import Task
from swarm_logistics_env.tasks.task_choice import DEFAULT, NAMES, refuse_untrusted

if TYPE_CHECKING:
    from swarm_logistics_env.studies.plan import Plan
    from swarm_logistics_env.studies.specification import Specification
    from swarm_logistics_env.studies.store import Store


SPECIFICATION = "specification"  # JSON
CODE = "code"  # version
IDENTITIES = "identities"  # of policies, JSON
DECLARED_SEEDS = "declared_seeds"  # how many, at the first run
DECLARED_FIRST_SEED = "declared_first_seed"  # at the first run; absent: 0
DECLARED_LOOKS = "declared_looks"  # JSON, at the first run
DECLARED_MARGIN = "declared_margin"  # at the first run; absent: the default
IMPORTED = "imported"  # the source of imported results; absent if the runs were played

_NEEDED = (SPECIFICATION, CODE, IDENTITIES, DECLARED_SEEDS)


# int() reads them back, so nothing but digits may stand there.
_Count = Annotated[int, Field(gt=0, strict=True)]
_Seed = Annotated[int, Field(ge=0, strict=True)]
_Share = Annotated[float, Field(gt=0, lt=1)]


class _Specified(Record):
    # What is read of a stored specification before its task is known.
    model_config = ConfigDict(extra="ignore")

    name: str
    seeds: _Count
    policies: tuple[Any, ...]
    first_seed: _Seed = 0
    task: str = DEFAULT


# These are read as JSON.
_FORMS: dict[str, TypeAdapter[Any]] = {
    SPECIFICATION: TypeAdapter(_Specified),
    IDENTITIES: TypeAdapter(dict[str, str]),
    DECLARED_SEEDS: TypeAdapter(_Count),
    DECLARED_FIRST_SEED: TypeAdapter(_Seed),
    DECLARED_LOOKS: TypeAdapter(tuple[_Count, ...]),
    DECLARED_MARGIN: TypeAdapter(_Share),
    IMPORTED: TypeAdapter(Origin),
}


def reads(name: str, value: object) -> bool:
    """Return whether a store's note is of the form that it should have."""
    if not isinstance(value, str):
        return False
    try:
        if name in _FORMS:
            _FORMS[name].validate_json(value)
    except ValidationError:
        return False
    return True


def planned(store: Store, directory: Path) -> dict[str, str]:
    """Return the notes from which the plan of a stored study follows.

    Raises:
        StudyError: one is missing.
    """
    found = {name: store.note(name) for name in (*_NEEDED, DECLARED_FIRST_SEED, DECLARED_LOOKS)}
    for name in _NEEDED:
        if found[name] is None:
            raise StudyError(
                f"the store in {directory} does not note its {name}: run the study once more "
                "there (finished runs are kept), then it will"
            )
    return {name: value for name, value in found.items() if value is not None}


def read_stored(
    text: str, place: Path, *, task: Task | None = None, trust_code: bool = False
) -> Specification:
    """Return the specification that a store in `place` holds as JSON.

    Args:
        task: the task that it names; None: it is found by that name.
        trust_code: whether it may be found by importing it, which runs its module.

    Raises:
        StudyError: it is damaged, or its task cannot be found.
    """
    fields = json.loads(text)
    named = fields.get("task", DEFAULT)
    if task is not None:
        fields["task"] = task
    elif ":" not in named and named not in NAMES:
        raise StudyError(
            f"{place}: was played on the task {named!r}, an object: should be handed over again, "
            "as Study.stored(.., task=..)"
        )
    else:
        refuse_untrusted(named, place, trust_code=trust_code)
    return Specification(**fields)


# Below ten seeds a verdict rests on normal differences: no look is proposed there.
FEWEST_TO_PROPOSE = 10


@dataclass(frozen=True)
class Declaration:
    """The seeds, looks and margin that a study declared before its first run.

    Attributes:
        seeds: of every condition.
        looks: numbers of seeds, from the first on, at which it was to be judged; empty: any.
        margin: of equivalence, as a share of P_o.
    """

    seeds: range
    looks: tuple[int, ...] = ()
    margin: float = MARGIN

    @classmethod
    def of(cls, specification: Specification) -> Self:
        """Return what a study declares that is run for the first time."""
        return cls(specification.seed_numbers, specification.looks, specification.margin)

    @classmethod
    def noted(cls, store: Store) -> Self | None:
        """Return what a store notes; None: nothing yet."""
        count = store.note(DECLARED_SEEDS)
        if count is None:
            return None
        first = int(store.note(DECLARED_FIRST_SEED) or 0)
        looks = json.loads(store.note(DECLARED_LOOKS) or "[]")
        margin = float(store.note(DECLARED_MARGIN) or MARGIN)
        return cls(range(first, first + int(count)), tuple(looks), margin)

    def note(self, store: Store) -> None:
        """Write it into a store."""
        store.set_note(DECLARED_FIRST_SEED, str(self.seeds.start))
        store.set_note(DECLARED_LOOKS, json.dumps(self.looks))
        store.set_note(DECLARED_MARGIN, str(self.margin))
        # The number of seeds is written last, so a store that has it has the others as well.
        store.set_note(DECLARED_SEEDS, str(len(self.seeds)))

    def covers(self, plan: Plan) -> bool:
        """Return whether the verdicts of a plan were declared, and so are not exploratory."""
        if plan.imported_from is not None:
            return True  # nothing is added to what was imported
        if not self.looks:
            return plan.seeds[0] in self.seeds and plan.seeds[-1] in self.seeds
        return (
            len(plan.seeds) in self.looks
            and plan.specification.looks == self.looks
            and plan.seeds[0] == self.seeds.start
        )

    def warning(self, plan: Plan) -> str:
        """Return the warning for a plan that this does not cover, and what to declare instead."""
        declared = _counted(self.seeds)
        if self.looks:
            declared = (
                f"looks at {', '.join(map(str, self.looks))} seeds from {self.seeds.start} on"
            )
        least = max(FEWEST_TO_PROPOSE, len(self.seeds))
        fresh = max(self.seeds.stop, plan.seeds[-1] + 1)
        return (
            f"This study declared {declared} before its first run: over {_counted(plan.seeds)} "
            "every verdict is exploratory. For verdicts that stand, run a new study in another "
            f"directory, on fresh seeds and with declared looks: first_seed = {fresh}, "
            f"seeds = {least}, looks = [{least}, {2 * least}, {4 * least}]."
        )


def _counted(seeds: Sequence[int]) -> str:
    count = "one seed" if len(seeds) == 1 else f"{len(seeds)} seeds"
    return f"{count} ({seeds_in_words(seeds)})"
