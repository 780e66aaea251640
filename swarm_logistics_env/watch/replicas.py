"""Replicas: a run's faults played on other seeds in the background: what R and FT they lead to."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

from swarm_logistics_env import spi
from swarm_logistics_env.episode import Episode, run_episode
from swarm_logistics_env.errors import SwarmLogisticsError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.watch.session import Session

MOST_SEEDS = 20
LEAST_SEEDS = 3  # of fewer the spread says nothing
EFFECT = 0.1  # the least R or FT that seeds are planned for


@dataclass(frozen=True)
class _Question:
    """The faults that hold now, to be played from the start of whole episodes."""

    scenario: Scenario
    policies: tuple[str, ...]
    seed: int
    faults: tuple[Fault, ...]

    def removed(self) -> tuple[Fault, ...]:
        """Return the same robots, each removed when it first fails: the paper's P_S."""
        onsets: dict[int, float] = {}
        for fault in sorted(self.faults, key=lambda fault: fault.onset):
            for robot in fault.robots if isinstance(fault.robots, tuple) else ():
                onsets.setdefault(robot, fault.onset)
        return tuple(Fault("removed", [robot], onset=onset) for robot, onset in onsets.items())


class Replicas:
    """Plays whole episodes in a thread and keeps R and FT of the faults that hold now.

    The seeds follow the one that is shown. A change of faults, policies or conditions begins anew;
    the runs without faults are kept.
    """

    def __init__(self) -> None:
        self._question: _Question | None = None
        self._load: Any = None
        self._changed = threading.Condition()
        self._results: list[dict[str, Any]] = []
        self._sound: dict[tuple[Scenario, str, int], Episode] = {}
        self._thread = threading.Thread(target=self._work, daemon=True)

    def ask(self, session: Session | None) -> None:
        """Let the thread work on what the session shows; None lets it rest."""
        question = None
        if session is not None:
            names = (session.policy, *filter(None, [session.against]))
            faults = session.run.world.faults
            question = _Question(session.scenario, names, session.seed, tuple(faults))
        if question == self._question:
            return
        if not self._thread.is_alive() and question is not None:
            self._thread.start()
        with self._changed:
            self._question = question
            if question is not None and session is not None:
                self._load, self._results = session.load, []
            self._changed.notify_all()

    def results(self) -> list[dict[str, Any]]:
        """Return an entry per indicator and policy: its estimate so far, and seeds that tell."""
        return self._results

    def _work(self) -> None:
        answered: _Question | None = None
        while True:
            with self._changed:
                while self._question is None or self._question is answered:
                    self._changed.wait()
                answered = self._question
            self._answer(answered)

    def _answer(self, question: _Question) -> None:
        removed = question.removed()
        if not removed:
            return
        runs: dict[str, list[tuple[Episode, Episode, Episode]]] = {}
        for seed in range(question.seed + 1, question.seed + 1 + MOST_SEEDS):
            for policy in question.policies:
                key = question.scenario, policy, seed
                try:
                    if key not in self._sound:
                        self._sound[key] = self._episode(*key, ())
                    sound = self._sound[key]
                    faulty = self._episode(*key, question.faults)
                    without = self._episode(*key, removed)
                except SwarmLogisticsError:
                    return  # the run that is shown meets the same error and tells it
                runs.setdefault(policy, []).append((sound, faulty, without))
                if self._question is not question:
                    return
            results = [
                entry
                for policy in runs
                for entry in indicators(
                    policy, runs[policy], question.scenario.n_robots, len(removed)
                )
            ]
            with self._changed:
                if self._question is question:
                    self._results = results

    def _episode(
        self, scenario: Scenario, policy: str, seed: int, faults: tuple[Fault, ...]
    ) -> Episode:
        return run_episode(scenario, self._load(policy), seed, faults)


def indicators(
    policy: str, runs: list[tuple[Episode, Episode, Episode]], n: int, m: int
) -> list[dict[str, Any]]:
    """Return R and, where a robot is left, FT of m faulty robots of n.

    Args:
        runs: for each seed the run without faults, with them, and with those robots removed.
    """
    sound, faulty, without = ([run.delivered for run in column] for column in zip(*runs))
    if not sum(sound):
        return []
    estimates = [spi.robustness(sound, faulty, n=n, m=m)]
    if m < n:
        estimates.append(spi.fault_tolerance(sound, faulty, without, n=n, m=m))
    return [
        {
            "policy": policy,
            "symbol": estimate.indicator,
            "value": round(estimate.value, 3),
            "interval": None
            if estimate.low is None or estimate.high is None
            else [round(max(-9.0, estimate.low), 3), round(min(9.0, estimate.high), 3)],
            "verdict": estimate.verdict,
            "seeds": estimate.n_seeds,
            "needed": None
            if estimate.n_seeds < LEAST_SEEDS
            else spi.seeds_for_power(estimate, EFFECT),
        }
        for estimate in estimates
    ]
