"""Declaration: what a study declared before its first run."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from swarm_logistics_env.spi.equivalence import MARGIN

from .plan import Plan

_Count = Annotated[int, Field(gt=0, strict=True)]


class Declaration(BaseModel):
    """What a study declared before its first run.

    Attributes:
        first_seed, seeds: the smallest seed, and how many there are of every condition.
        looks: numbers of seeds, from the first on, at which comparisons may stop; empty: none.
        margin: of equivalence, as a share of P_o.
    """

    model_config = ConfigDict(frozen=True, from_attributes=True)

    first_seed: Annotated[int, Field(ge=0, strict=True)]
    seeds: _Count
    looks: tuple[_Count, ...] = ()
    margin: Annotated[float, Field(gt=0, lt=1)] = MARGIN

    def covers(self, plan: Plan) -> bool:
        """Return whether the verdicts of a plan were declared, and so are not exploratory."""
        if plan.origin is not None:
            return True  # nothing is added to what was imported
        # A part of the declared seeds is a choice as well, made with the results at hand.
        seeds = range(self.first_seed, self.first_seed + self.seeds)
        return plan.seeds == seeds and self.looks in ((), plan.specification.looks)
