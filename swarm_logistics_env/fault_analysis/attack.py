"""The worst fault that a search finds, with an estimate on fresh seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import SetupError, StudyError, suggest
from swarm_logistics_env.fault_analysis.fault_search import Play, random_search, search
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.spi import Estimate, robustness
from swarm_logistics_env.studies.engines import Engine
from swarm_logistics_env.studies.judged_comparisons import same_runs
from swarm_logistics_env.studies.performance_table import Played, played
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.studies.store import Store
from swarm_logistics_env.tasks.policy_choice import policy_identity, policy_label
from swarm_logistics_env.tasks.task import Outcome
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.warehouse import FAILURE_MODES, Fault
from swarm_logistics_env.warehouse.roles import ROLES

STORE = "runs.sqlite"
# A removed robot is the reference of the others; motor_wear leaves more speed than motor_slow.
MODES = tuple(mode for mode in FAILURE_MODES if mode not in ("removed", "motor_wear"))
_ONSETS = (0.0, 0.2, 0.4, 0.6)  # shares of an episode
_DURATIONS = (None, 0.2, 0.4)  # shares of an episode; None: for good
_NAMED_SEEDS = 5  # runs of each named mode, from which the worst is chosen


@dataclass(frozen=True)
class Attack:
    """What to search, and how long.

    Attributes:
        policy: as `policies.load` knows it, or a policy.
        scenario: conditions of every episode.
        robots: how many fail.
        modes: failure modes to search among.
        budget: runs of faults in the search; the random search has as many.
        fresh: seeds of the estimates, none of which the search has met; at least 3.
        seed: of the search's own choices.
    """

    policy: object
    scenario: Scenario
    robots: int = 2
    modes: tuple[str, ...] = MODES
    budget: int = 200
    fresh: int = 30
    seed: int = 0

    def faults(self) -> list[Fault]:
        """Return all faults that are searched: every mode, role, onset and duration.

        Raises:
            SetupError: a mode is unknown, or there are fewer robots.
        """
        for mode in self.modes:
            if mode not in MODES:
                raise SetupError(f"modes: no mode {mode!r} to search{suggest(mode, MODES)}")
        if not 1 <= self.robots < self.scenario.n_robots:
            raise SetupError(f"robots = {self.robots}: should be 1 to {self.scenario.n_robots - 1}")
        end = self.scenario.duration
        return [
            Fault(
                mode,
                self.robots,
                onset=round(onset * end, 1),
                duration=None if lasts is None else round(lasts * end, 1),
                role=role,
            )
            for mode, role, onset, lasts in product(self.modes, (None, *ROLES), _ONSETS, _DURATIONS)
            # At the start nobody carries anything, and nobody stands in the delivery area.
            if onset > 0.0 or role in (None, "searching")
        ]


@dataclass(frozen=True)
class Found:
    """A fault, how it was found, and its robustness on fresh seeds.

    Attributes:
        by: "search", "random search" or "named modes".
        runs: how many runs of faults it took.
    """

    by: str
    fault: Fault
    robustness: Estimate
    runs: int


@dataclass(frozen=True)
class AttackResult:
    """The worst faults found, the search's first.

    Attributes:
        tried: how many different faults the search has tried.
        searched: how many there were to search.
        is_capped: whether every item was delivered in a run without a fault on a fresh seed, so
            that the faults may cost more than R tells.
    """

    found: tuple[Found, ...]
    tried: int
    searched: int
    is_capped: bool


def attack(asked: Attack, engine: Engine, out: Path) -> AttackResult:
    """Search for the worst fault, and estimate its robustness on fresh seeds.

    What it finds bounds the worst fault from one side: there may be worse ones. Every run is kept
    in `out` at once, and the same call goes on from there.

    Raises:
        SetupError: as `Attack.faults`; or the policy delivers nothing without faults.
        PolicyError: there is no such policy.
        StudyError: the directory cannot be used, or a run failed.
    """
    faults = asked.faults()
    label, identity = policy_label(asked.policy), policy_identity(asked.policy)
    policy = StudiedPolicy(label, identity, asked.policy)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {out}: {error.strerror}") from error
    with Store(out / STORE) as store:
        players = _Players(policy, asked.scenario, engine, store)
        play = players.search_play(faults)
        worst, trials = search(faults, play, asked.budget, asked.seed)
        at_random, _ = random_search(faults, play, asked.budget, asked.seed)
        named = [Fault(mode, asked.robots) for mode in asked.modes]
        tries = players.played(named, range(_NAMED_SEEDS))
        worst_named = int(np.argmin([runs.by_seed.mean() for runs in tries]))
        # Seeds that neither search can have met, nor the choice among the named modes.
        first = max(asked.budget, _NAMED_SEEDS)
        fresh = range(first, first + asked.fresh)
        chosen = [
            ("search", faults[worst], asked.budget),
            ("random search", faults[at_random], asked.budget),
            ("named modes", named[worst_named], _NAMED_SEEDS * len(named)),
        ]
        sound, *failed = players.played([None, *(fault for _, fault, _ in chosen)], fresh)
    return AttackResult(
        found=tuple(
            Found(by, fault, _robustness(asked, sound, with_fault), runs)
            for (by, fault, runs), with_fault in zip(chosen, failed, strict=True)
        ),
        tried=len(set(trials.tried)),
        searched=len(faults),
        is_capped=sound.saturated,
    )


def _robustness(asked: Attack, sound: Played, failed: Played) -> Estimate:
    return robustness(
        sound.by_seed,
        failed.by_seed,
        n=asked.scenario.n_robots,
        m=asked.robots,
        saturated=[name for name, runs in (("p_o", sound), ("p_f", failed)) if runs.saturated],
        identical=same_runs(sound.digests, failed.digests),
    )


class _Players:
    """Plays faults over seeds; every run is kept in a store and played once."""

    def __init__(
        self, policy: StudiedPolicy, scenario: Scenario, engine: Engine, store: Store
    ) -> None:
        self._policy, self._scenario = policy, scenario
        self._engine, self._store = engine, store

    def played(self, faults: Sequence[Fault | None], seeds: Sequence[int]) -> list[Played]:
        """Return the runs of each fault (None: without one) over the seeds."""
        outcomes = self._outcomes([(fault, seed) for fault in faults for seed in seeds])
        n = len(seeds)
        return [played(outcomes[place * n : (place + 1) * n]) for place in range(len(faults))]

    def search_play(self, faults: Sequence[Fault]) -> Play:
        """Return what plays a fault's k-th run with seed k, beside the run without a fault."""

        def play(pairs: Sequence[tuple[int, int]]) -> Sequence[float]:
            last = max(seed for _, seed in pairs)
            sound = self._delivered([(None, seed) for seed in range(max(last + 1, _NAMED_SEEDS))])
            if not sound.any():
                raise SetupError(
                    f"{self._policy.label} delivers nothing without faults, so no fault can cost "
                    "anything: should be another policy, a longer duration or more robots"
                )
            failed = self._delivered([(faults[place], seed) for place, seed in pairs])
            return list(failed - sound[[seed for _, seed in pairs]])

        return play

    def _delivered(self, pairs: Sequence[tuple[Fault | None, int]]) -> NDArray[np.float64]:
        return played(self._outcomes(pairs)).by_seed

    def _outcomes(self, pairs: Sequence[tuple[Fault | None, int]]) -> list[Outcome]:
        code = WAREHOUSE.code()
        runs = [
            Condition(
                self._policy, self._scenario, () if fault is None else (fault,), task=WAREHOUSE
            ).run(code, seed)
            for fault, seed in pairs
        ]
        done = self._store.succeeded()
        missing = {run.key: run for run in runs if run.key not in done}
        for run, outcome in self._engine(missing.values()):
            self._store.add(run, outcome)
            if outcome.error is not None:
                raise StudyError(f"a run failed: {outcome.error.strip().splitlines()[-1]}")
        outcomes = self._store.outcomes(runs)
        return [outcomes[run.key] for run in runs]
