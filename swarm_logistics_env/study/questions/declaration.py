"""Declaration: what a study declared before its first run."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from swarm_logistics_env.spi.equivalence import MARGIN

from .plan import Plan
from .specification import text_if_any

_Count = Annotated[int, Field(gt=0, strict=True)]


class Declaration(BaseModel):
    """What a study declared before its first run.

    Attributes:
        first_seed, seeds: the smallest seed, and how many there are of every condition.
        looks: numbers of seeds, from the first on, at which comparisons may stop; empty: none.
        margin: of equivalence, as a share of P_o.
        performance: what P of a run is; None: what the task counts.
    """

    model_config = ConfigDict(frozen=True, from_attributes=True)

    first_seed: Annotated[int, Field(ge=0, strict=True)]
    seeds: _Count
    looks: tuple[_Count, ...] = ()
    margin: Annotated[float, Field(gt=0, lt=1)] = MARGIN
    performance: Annotated[str | None, BeforeValidator(text_if_any)] = None

    def covers(self, plan: Plan) -> bool:
        """Return whether the verdicts of a plan were declared, and so are not exploratory."""
        if plan.origin is not None:
            return True  # nothing is added to what was imported
        # A part of the declared seeds is a choice as well, made with the results at hand.
        seeds = range(self.first_seed, self.first_seed + self.seeds)
        is_same_p = self.performance == text_if_any(plan.specification.performance)
        return plan.seeds == seeds and is_same_p and self.looks in ((), plan.specification.looks)
