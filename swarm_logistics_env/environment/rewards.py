"""The reward: named terms with the weights that an environment gives them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.packing import packed
from swarm_logistics_env.core.code_files import import_callable
from swarm_logistics_env.core.errors import SetupError, suggest
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.floor_cells import floor_map
from swarm_logistics_env.world.warehouse.structs import NOBODY

from .reward_terms import REWARD_TERMS, Payment, moment_of, pay_robots

DEFAULT_WEIGHTS: Mapping[str, float] = {"delivery": 1.0}
_AT_DELIVERIES = {"delivery", "own_delivery", "on_time"}


class RewardTerms:
    """The weighted sum of named terms, one value per robot and step.

    Args:
        weights: term -> weight; see `REWARD_TERMS` for the terms. "my.py:term" or
            "package.module:term" is one of your own, whose module is imported, and so executed:
            a function of (world, before, after), see `Moment`, that returns what each robot earned
            in the step (N,), or one number for all.

    Attributes:
        pays_steadily: whether a step without a delivery may pay.
        are_compiled: whether no term is one of one's own.
        address: of the words of its `Payment`, once an episode began.

    Raises:
        SetupError: `weights` is not a dict, a term is unknown, or a weight is not a finite number.
    """

    def __init__(self, weights: Mapping[str, float] | None = None) -> None:
        if weights is not None and not isinstance(weights, Mapping):
            raise SetupError(
                f'rewards = {weights!r}: should be None or a dict, as {{"delivery": 1.0}}'
            )
        weights = DEFAULT_WEIGHTS if weights is None else weights
        for name, weight in weights.items():
            term_of(name)
            finite_number(f"rewards[{name!r}]", weight)
        self._scenario: Scenario | None = None  # of an episode
        self.reweigh(weights)

    def reweigh(self, weights: Mapping[str, float]) -> None:
        """Pay by other terms or weights from the next step on."""
        self._weights = dict(weights)
        self.pays_steadily = not _AT_DELIVERIES.issuperset(weights)
        self._own_terms = [
            (row, name, term_of(name))
            for row, name in enumerate(weights)
            if name not in REWARD_TERMS
        ]
        self.are_compiled = not self._own_terms
        if self._scenario is not None:
            self._build(self._scenario)

    def __getstate__(self) -> dict[str, Any]:
        # Addresses are other ones elsewhere, and a function of the user's file is imported anew.
        saved = ("_weights", "_scenario", "_before")
        return {name: value for name, value in vars(self).items() if name in saved}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.__dict__.update(saved)
        self.reweigh(self._weights)

    def begin(self, world: Warehouse) -> None:
        """Store the state at the start of an episode."""
        self._scenario = world.scenario
        self._before = moment_of(world)
        self._build(world.scenario)

    def _build(self, scenario: Scenario) -> None:
        numbers = {name: number for number, name in enumerate(REWARD_TERMS)}
        n_terms = len(self._weights)
        self._payment = Payment(
            before=self._before,
            ways=floor_map(scenario).ways(scenario.names_docks),
            terms=np.array([numbers.get(name, NOBODY) for name in self._weights], np.int64),
            weights=np.array(list(self._weights.values()), np.float64),
            earned=np.zeros((n_terms, scenario.n_robots)),
            total=np.zeros(scenario.n_robots),
        )
        self._words = packed(self._payment)
        self.address: int = self._words.ctypes.data

    def pay(self, world: Warehouse) -> NDArray[np.float64]:
        """Return the reward of the step just taken, (N,): one number for each robot.

        Raises:
            SetupError: a term of one's own returned what is not finite.
        """
        if self._own_terms:
            after = moment_of(world)
            for row, name, term in self._own_terms:
                earned = term(world, self._before, after)
                self._payment.earned[row] = _checked(name, earned)
        pay_robots(world.address, self.address)  # the moment before becomes that after
        self._before = self._before._replace(delivered=world.state.delivered)
        return self._payment.total.copy()


def term_of(name: str) -> Any:
    """Return the reward term of that name, or the one that "my.py:term" names.

    Raises:
        SetupError: there is none.
    """
    if name in REWARD_TERMS:
        return REWARD_TERMS[name]
    if ":" not in name:
        raise SetupError(f"no reward term {name!r}{suggest(name, REWARD_TERMS)}")
    return import_callable("reward term", name, SetupError)


def _checked(name: str, earned: NDArray[np.float64] | float | None) -> NDArray[np.float64]:
    values = np.asarray(0.0 if earned is None else earned, np.float64)
    finite = np.isfinite(values)
    if not finite.all():
        raise SetupError(f"reward term {name!r} = {values[~finite][0]}: should be finite")
    return values


def finite_number(name: str, value: float) -> float:
    """Return the value as a float.

    Raises:
        SetupError: it is not a number, or not finite.
    """
    if not isinstance(value, int | float | np.number) or not np.isfinite(value):
        raise SetupError(f"{name} = {value!r}: should be a finite number")
    return float(value)
