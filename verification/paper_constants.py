"""The constants that the paper leaves open, searched on half of its cells, judged on the others.

A candidate is one choice of all constants. The first candidates are spread over the ranges; from
their runs a model of P (`verification.paper_model`) proposes more for each half of the cells, and
those that meet that half best get more seeds. The best of each half and the defaults then play the
other half on fresh seeds. Every run is kept in a store at once: a search that was killed goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import groupby
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue
from scipy import stats

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.swarm_dt import SwarmDTParameters
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.streams import generator, key
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.engines import serial
from swarm_logistics_env.studies.plan import make_plan
from swarm_logistics_env.studies.presets import PAPER, load_preset
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.studies.store import Store
from swarm_logistics_env.tasks.policy_choice import policy_identity, policy_label
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE
from verification.paper_model import Model, fitted

Floats: TypeAlias = NDArray[np.float64]
Candidate: TypeAlias = tuple[float, ...]  # a value of each constant, in the order of `RANGES`

ITEMS = "items in Table I"
# Lowest and highest value of each constant; candidates are spread evenly over its logarithm.
RANGES: Mapping[str, tuple[float, float]] = {
    "wall_distance": (0.13, 0.6),
    "diffusion": (0.1, 4.0),
    "avoidance_gain": (0.5, 6.0),
    "avoidance_range": (0.26, 1.0),
    "taxis_gain": (0.2, 2.0),
    "radio_range": (2.0, 8.0),
    ITEMS: (80.0, 200.0),
}
CELLS: tuple[Setting, ...] = PAPER.cells
PUBLISHED = np.array([PAPER.performance[cell] for cell in CELLS], dtype=np.float64)
TABLE_I = tuple(k for k, cell in enumerate(CELLS) if cell.kind == "size")
FM1 = tuple(k for k, cell in enumerate(CELLS) if cell.name == "FM1")
LEAST = 0.5  # [items], in place of a mean P of 0, which has no logarithm
# The search has the seeds from 0 on, the judgement those on which docs/results.md rests.
FIRST_FRESH = 20_000


class Budget(NamedTuple):
    """How much is played.

    Attributes:
        first: candidates that are spread over the ranges, each with one seed.
        rounds: of each half: how many candidates stay, and how many seeds each has by then.
        fresh: seeds of the judgement.
        reference: seeds of the defaults, the first `fresh` of them those of the judgement; they
            tell how single runs spread.
        duration: of an episode [s].
    """

    first: int = 46
    rounds: tuple[tuple[int, int], ...] = ((3, 1),)
    fresh: int = 20
    reference: int = 30
    duration: float = 500.0


@cache
def _conditions() -> Mapping[Setting, Condition]:
    """Return the condition of each cell with the defaults."""
    plan = make_plan(load_preset("paper"))
    return {arm.setting: arm.condition for _, _, arm in plan.cells if arm.setting in CELLS}


def defaults() -> Candidate:
    """Return the constants as the package has them."""
    items = {ITEMS: _conditions()[CELLS[TABLE_I[0]]].scenario.n_items}
    known = {**Scenario().model_dump(), **SwarmDTParameters().model_dump(), **items}
    return tuple(float(known[name]) for name in RANGES)


def candidates_at(places: Floats) -> list[Candidate]:
    """Return the candidates at places (n, constants) of the unit cube, with three digits."""
    low, high = np.log(np.array(list(RANGES.values()))).T
    values = np.exp(low + places * (high - low))
    return [
        tuple(
            float(round(value)) if name == ITEMS else float(f"{value:.3g}")
            for name, value in zip(RANGES, row)
        )
        for row in values
    ]


def places_of(candidates: Sequence[Candidate]) -> Floats:
    """Return the places (n, constants) of candidates in the unit cube; see `candidates_at`."""
    low, high = np.log(np.array(list(RANGES.values()))).T
    places: Floats = (np.log(np.array(candidates)) - low) / (high - low)
    return places


def spread(count: int, purpose: str) -> Floats:
    """Return places (count, constants) spread evenly over the unit cube."""
    sobol = stats.qmc.Sobol(len(RANGES), seed=key(0, purpose))
    power_of_two = 1 << (count - 1).bit_length()
    return np.asarray(sobol.random(power_of_two)[:count], dtype=np.float64)


def halves() -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the places in `CELLS` of two halves, each with its share of every table and mode."""
    rng = generator(0, "halves of the paper's cells")
    dealt: list[int] = []
    for _, group in groupby(range(len(CELLS)), lambda k: (CELLS[k].kind, CELLS[k].name)):
        dealt += [int(k) for k in rng.permutation(list(group))]
    return tuple(sorted(dealt[::2])), tuple(sorted(dealt[1::2]))


def errors(means: Floats, cells: Sequence[int]) -> Floats:
    """Return |ln(mean P / published P)| of means (.., cells) at these places in `CELLS`."""
    found: Floats = np.abs(np.log(np.maximum(means, LEAST) / PUBLISHED[list(cells)]))
    return found


class Players:
    """Plays candidates; every run is kept in a store and played once."""

    def __init__(self, store: Store, duration: float) -> None:
        self._store, self._duration, self._code = store, duration, WAREHOUSE.code()

    def played(self, candidate: Candidate, cells: Sequence[int], seeds: Sequence[int]) -> Floats:
        """Return P (cells, seeds) of a candidate.

        Raises:
            StudyError: a run failed.
        """
        conditions = [self._condition(candidate, CELLS[k]) for k in cells]
        # Seed by seed, so that a search that was stopped has complete seeds.
        runs = [c.run(self._code, seed) for seed in seeds for c in conditions]
        there = self._store.outcomes(runs)
        missing = {run.key: run for run in runs if run.key not in there}
        for run, outcome in serial(missing.values()):
            self._store.add(run, outcome)
            if outcome.error is not None:
                raise StudyError(f"a run failed: {outcome.error.strip().splitlines()[-1]}")
            there[run.key] = outcome
        p = np.array([there[run.key].delivered for run in runs], dtype=np.float64)
        return p.reshape(len(seeds), len(cells)).T

    def _condition(self, candidate: Candidate, cell: Setting) -> Condition:
        known = _conditions()[cell]
        changes: dict[str, float] = {"duration": self._duration}
        parameters: dict[str, JsonValue] = {}
        for name, value in zip(RANGES, candidate):
            if name == ITEMS:
                changes |= {"n_items": int(value)} if cell.kind == "size" else {}
            elif name in Scenario.model_fields:
                changes[name] = value
            else:
                parameters[name] = value
        # The defaults' runs have the keys that they have in the paper's study.
        own = candidate == defaults()
        source = "swarm-dt" if own else PolicySpec(name="swarm-dt", parameters=parameters)
        identity = policy_identity(source, WAREHOUSE.policies)
        policy = StudiedPolicy(policy_label(source), identity, source)
        scenario = known.scenario.replace(**changes)
        return Condition(policy, scenario, known.faults, task=WAREHOUSE)


def first_runs(players: Players, budget: Budget) -> tuple[list[Candidate], Floats]:
    """Play the candidates that are spread over the ranges; return them and P (n, cells).

    Each has a seed of its own, so that no layout's luck is in all of them.
    """
    candidates = candidates_at(spread(budget.first, "first candidates"))
    everything = range(len(CELLS))
    p = [players.played(c, everything, [seed])[:, 0] for seed, c in enumerate(candidates)]
    return candidates, np.array(p)


def model_of(candidates: Sequence[Candidate], p: Floats, cells: Sequence[int]) -> Model:
    """Return a model of these cells from one run of each candidate (n, cells of the paper)."""
    uses = [[name != ITEMS or k in TABLE_I for name in RANGES] for k in cells]
    return fitted(places_of(candidates), p[:, list(cells)], np.array(uses))


def proposed(model: Model, cells: Sequence[int], count: int, purpose: str) -> list[Candidate]:
    """Return the candidates that a model of these cells expects to meet them best, far apart."""
    blocks = np.split(spread(4096 * count, purpose), count)
    best = [block[errors(model.means(block), cells).mean(axis=1).argmin()] for block in blocks]
    return candidates_at(np.array(best))


class Searched(NamedTuple):
    """What a search on some cells found.

    Attributes:
        cells: places in `CELLS`.
        best: the candidate.
        loss: its mean |ln(mean P / published P)| on the search's seeds.
    """

    cells: tuple[int, ...]
    best: Candidate
    loss: float


def search(
    players: Players,
    budget: Budget,
    first: tuple[list[Candidate], Floats],
    cells: tuple[int, ...],
) -> Searched:
    """Return the candidate that meets these cells best; no other cell decides anything."""
    candidates, p = first
    model = model_of(candidates, p, cells)
    count = budget.rounds[0][0]
    left = proposed(model, cells, count, f"candidates for the cells {cells}")
    for stay, n_seeds in budget.rounds:
        losses = {}
        for candidate in left[:stay]:
            # Seeds that the first candidates did not have.
            seeds = range(budget.first, budget.first + n_seeds)
            means = players.played(candidate, cells, seeds).mean(axis=1)
            losses[candidate] = float(errors(means, cells).mean())
        left = sorted(losses, key=losses.__getitem__)
    return Searched(cells, left[0], losses[left[0]])


class Judged(NamedTuple):
    """The best candidate of one half beside the defaults, on the other half with fresh seeds.

    Attributes:
        searched: what the search found.
        cells: places in `CELLS` of the half that it did not see.
        p, p_defaults: P (cells, seeds) of both.
    """

    searched: Searched
    cells: tuple[int, ...]
    p: Floats
    p_defaults: Floats

    @property
    def losses(self) -> tuple[float, float]:
        """Mean |ln(mean P / published P)| of the candidate and of the defaults."""
        of_each = (errors(p.mean(axis=1), self.cells).mean() for p in (self.p, self.p_defaults))
        candidate, defaults = map(float, of_each)
        return candidate, defaults

    @property
    def difference(self) -> Interval:
        """The candidate's loss minus that of the defaults, with its 95 % interval.

        The interval is over the cells, because each published value is taken as one run.
        """
        candidate, defaults = (
            errors(p.mean(axis=1), self.cells) for p in (self.p, self.p_defaults)
        )
        return t_interval(candidate - defaults)


class Found(NamedTuple):
    """All that was played.

    Attributes:
        first: the candidates that are spread over the ranges.
        p_first: P of one run of each (n, cells).
        judged: of both halves.
        p_defaults: P of the defaults on all fresh seeds (cells, seeds).
        trade: the candidate that the model expects to meet Table I and FM1 together best.
        p_trade: its P on fresh seeds in the cells of these two (cells, seeds).
    """

    first: list[Candidate]
    p_first: Floats
    judged: tuple[Judged, ...]
    p_defaults: Floats
    trade: Candidate
    p_trade: Floats


def play(players: Players, budget: Budget) -> Found:
    """Search on each half, and judge what was found and the defaults on the other one."""
    first, p_first = first_runs(players, budget)
    found = [search(players, budget, (first, p_first), cells) for cells in halves()]
    seeds = range(FIRST_FRESH, FIRST_FRESH + budget.reference)
    p_defaults = players.played(defaults(), range(len(CELLS)), seeds)
    fresh = seeds[: budget.fresh]
    judged = tuple(
        Judged(
            one,
            other,
            players.played(one.best, other, fresh),
            p_defaults[list(other), : len(fresh)],
        )
        for one, other in zip(found, reversed(halves()))
    )
    both = (*TABLE_I, *FM1)
    (trade,) = proposed(model_of(first, p_first, both), both, 1, "Table I and FM1")
    p_trade = players.played(trade, both, fresh)
    return Found(first, p_first, judged, p_defaults, trade, p_trade)
