"""Declaration: the seeds and looks that a study named before its first run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from swarm_logistics_env.studies import notes
from swarm_logistics_env.studies.seeds import seeds_in_words

if TYPE_CHECKING:
    from swarm_logistics_env.studies.plan import Plan
    from swarm_logistics_env.studies.store import Store

# Below ten seeds a verdict rests on normal differences: no look is proposed there.
FEWEST_TO_PROPOSE = 10


@dataclass(frozen=True)
class Declaration:
    """What a study was declared to be judged on.

    Attributes:
        seeds: of every condition.
        looks: numbers of seeds, from the first on, at which it was to be judged; empty: any.
    """

    seeds: range
    looks: tuple[int, ...] = ()

    @classmethod
    def noted(cls, store: Store) -> Self | None:
        """Return what a store notes; None: nothing yet."""
        count = store.note(notes.DECLARED_SEEDS)
        if count is None:
            return None
        first = int(store.note(notes.DECLARED_FIRST_SEED) or 0)
        looks = json.loads(store.note(notes.DECLARED_LOOKS) or "[]")
        return cls(range(first, first + int(count)), tuple(looks))

    def note(self, store: Store) -> None:
        """Note it in a store."""
        store.set_note(notes.DECLARED_FIRST_SEED, str(self.seeds.start))
        store.set_note(notes.DECLARED_LOOKS, json.dumps(self.looks))
        # Last: where it is noted, the others are.
        store.set_note(notes.DECLARED_SEEDS, str(len(self.seeds)))

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
        """Return what a plan that this does not cover costs, and what to declare instead."""
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
