"""The search for the worst fault: against chance, killed, and refused."""

from __future__ import annotations

import re
from collections.abc import Generator, Iterable, Sequence
from itertools import islice, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.errors import SetupError, StudyError
from swarm_logistics_env.spi import robustness
from swarm_logistics_env.study.attack import (
    _NOISES,
    STORE,
    Attack,
    _covariance,
    _posterior,
    attack,
    search,
)
from swarm_logistics_env.study.runs.engines import serial
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run
from swarm_logistics_env.world.scenario import ROLES
from tests.made_up import delivered

SCENARIO = Scenario(
    n_robots=6, warehouse_width=5.0, warehouse_height=5.0, delivery_width=1.5, n_items=8,
    restock=True, duration=30.0,
)  # fmt: skip


@pytest.mark.unmeasured
def test_the_search_comes_nearer_to_the_worst_fault_than_chance() -> None:
    modes, roles = ("FM1", "FM2", "FM3", "FM4", "dead"), ("carrier", "searching")
    kinds = list(product(modes, roles, (10.0, 30.0), (None, 15.0)))
    faults = [Fault(mode, 2, onset=at, duration=t, role=role) for mode, role, at, t in kinds]

    def regrets(seed: int) -> tuple[float, float]:
        rng = np.random.default_rng(seed)
        cost = np.zeros(len(kinds))
        for n in (1, 2, 3):  # by mode, by role within it, by onset within that; and luck
            alike = sorted({kind[:n] for kind in kinds})
            effects = dict(zip(alike, rng.normal(size=len(alike))))
            cost += [effects[kind[:n]] for kind in kinds]

        def play(pairs: Sequence[tuple[int, int]]) -> list[float]:
            return [float(cost[number] + rng.normal(0.0, 2.0)) for number, _ in pairs]

        worst, tried = search(faults, play, 60, seed)
        assert len(tried) == 60
        chosen = rng.choice(len(kinds), 30, replace=False)  # two runs of each
        at_random = chosen[(cost[chosen] + rng.normal(0.0, 2.0 / np.sqrt(2), 30)).argmin()]
        return cost[worst] - cost.min(), cost[at_random] - cost.min()

    by_search, by_chance = np.mean([regrets(seed) for seed in range(30)], axis=0)
    assert by_search < 0.8 * by_chance


@pytest.mark.unmeasured
def test_a_search_that_was_stopped_goes_on_ends_alike_and_tells_how_far_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    settings = Attack("swarm-dt", SCENARIO, modes=("FM4", "dead"), budget=12, fresh=3)
    uninterrupted = attack(settings, serial, tmp_path / "whole")

    def stopped(runs: Any) -> Any:
        yield from islice(serial(runs), 3)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attack(settings, stopped, tmp_path / "stopped")
    with Runs(tmp_path / "stopped" / STORE) as runs:
        assert len(runs) == 3
    before, *_ = capsys.readouterr().err.splitlines()
    assert re.match(r"attack: 1 of 43 runs at most, 0:\d\d so far, \d+:\d\d left", before)
    assert attack(settings, serial, tmp_path / "stopped") == uninterrupted
    assert capsys.readouterr().err.startswith("attack: 4 of 43 runs at most, ")
    assert [worst.by for worst in uninterrupted.found] == ["search", "named modes"]
    assert {
        (worst.robustness.n_seeds, worst.robustness.paired) for worst in uninterrupted.found
    } == {(3, True)}


def test_what_cannot_be_searched_is_refused(tmp_path: Path) -> None:
    short = SCENARIO.replace(duration=0.5)
    for settings, reason in (
        (
            Attack("swarm-dt", SCENARIO, modes=("FM9",)),
            "^modes: no mode 'FM9' to search; did you mean",
        ),
        (Attack("swarm-dt", SCENARIO, modes=("removed",)), "^modes: no mode 'removed' to search"),
        (Attack("swarm-dt", SCENARIO, robots=6), "^robots = 6: should be 1 to 5$"),
        (Attack("swarm-dt", SCENARIO, robots=0), "^robots = 0: should be 1 to 5$"),
        (Attack("swarm-dt", short, budget=10, fresh=3), "delivers nothing without faults"),
    ):
        with pytest.raises(SetupError, match=reason):
            attack(settings, serial, tmp_path)


def test_a_run_that_fails_ends_the_search_and_is_kept(tmp_path: Path) -> None:
    def failing(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        for run in runs:
            yield run, Outcome(error="Traceback\nValueError: no wheel\n")

    with pytest.raises(StudyError, match=r"^a run failed: ValueError: no wheel$"):
        attack(Attack("swarm-dt", SCENARIO), failing, tmp_path)
    with Runs(tmp_path / STORE) as runs:
        assert (len(runs), runs.succeeded()) == (1, set())


def test_a_cap_on_the_runs_without_faults_is_told(tmp_path: Path) -> None:
    scenario = SCENARIO.replace(restock=False, n_items=3)  # all are delivered early
    settings = Attack("homing", scenario, 1, modes=("FM2",), budget=10, fresh=12)
    result = attack(settings, serial, tmp_path)
    assert result.is_capped
    assert "supported" not in {worst.robustness.verdict for worst in result.found}


def test_a_fault_that_changes_no_run_is_no_evidence_and_seeds_of_estimates_are_fresh(
    tmp_path: Path,
) -> None:
    settings = Attack("random-walk", SCENARIO, 1, modes=("FM3_hear",), budget=1, fresh=3)
    result = attack(settings, serial, tmp_path)
    assert all(worst.robustness.identical for worst in result.found)
    assert not result.is_capped
    with Runs(tmp_path / STORE) as runs:
        rows = runs.frame().to_dict("records")
    # Five for the choice among the named modes, and three that had no part in any choice.
    assert sorted(row["seed"] for row in rows if row["faults"] == "[]") == list(range(8))


def test_every_role_is_searched_at_every_time_at_which_robots_may_have_it() -> None:
    scenario = SCENARIO.replace(duration=30.2)
    faults = Attack("swarm-dt", scenario, modes=("FM4",)).faults()
    times = [(onset, lasts) for onset in (0.0, 6.0, 12.1, 18.1) for lasts in (None, 6.0, 12.1)]
    assert {(fault.role, fault.onset, fault.duration) for fault in faults} == {
        (role, *time)
        for role, time in product((None, *ROLES), times)
        if time[0] or role in (None, "searching")
    }
    assert len(faults) == 60


def test_faults_are_the_more_alike_the_more_they_share() -> None:
    fault = Fault("FM1", 1, onset=0.0, role="carrier")
    neighbours = [
        fault.replace(onset=9.0), fault.replace(role="searching"),
        fault.replace(role="searching", onset=9.0), Fault("FM2", 1, onset=0.0, role="carrier"),
    ]  # fmt: skip
    alike = _covariance([fault, *neighbours])
    assert np.diag(alike).tolist() == pytest.approx([1.0] * 5)
    np.testing.assert_array_equal(alike, alike.T)
    at_another_time, in_another_role, in_both, of_another_mode = alike[0, 1:]
    assert 1.0 > at_another_time > in_both > of_another_mode == 0.0
    assert 1.0 > in_another_role > in_both


def test_what_was_never_tried_is_not_named() -> None:
    faults = Attack("swarm-dt", SCENARIO, modes=("FM1", "FM4")).faults()
    for seed in range(10):
        worst, tried = search(faults, lambda pairs: [-3.0] * len(pairs), 1, seed)
        assert tried == [worst]


def test_a_quarter_of_the_budget_is_tried_at_random_and_the_rest_in_eight_rounds() -> None:
    faults = Attack("swarm-dt", SCENARIO, modes=("FM1", "FM4")).faults()
    rounds: list[Sequence[tuple[int, int]]] = []

    def play(pairs: Sequence[tuple[int, int]]) -> list[float]:
        rounds.append(pairs)
        return [float(index % 7) for index, _ in pairs]

    worst, tried = search(faults, play, 60, 0)
    assert [*map(len, rounds)] == [15, 6, 5, 6, 6, 5, 6, 5, 6]
    runs = [pair for pairs in rounds for pair in pairs]
    # Each run of a fault is of the next seed.
    assert runs == [(index, tried[:k].count(index)) for k, index in enumerate(tried)]
    assert len({index for index, _ in rounds[0]}) == 15
    assert worst % 7 == 0


def test_each_run_is_measured_against_that_of_its_seed_without_a_fault(tmp_path: Path) -> None:
    costs = {"FM1": 4, "FM2": 10, "FM3": 6, "FM4": 8}
    faults_of_runs: list[Any] = []

    def engine(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        for run in runs:  # seeds differ far more than faults
            faults_of_runs.append(run.case.faults)
            cost = sum(costs[fault.mode] for fault in run.case.faults)
            yield run, delivered(20 + 200 * (run.seed % 3 == 1) - cost, digest=run.key)

    settings = Attack("swarm-dt", SCENARIO, modes=tuple(costs), budget=40)
    result = attack(settings, engine, tmp_path)
    fresh = np.array([20.0 + 200.0 * (seed % 3 == 1) for seed in range(40, 70)])
    expected = robustness(fresh, fresh - 10.0, n=6, m=2, saturated=[], identical=False)
    by_search, by_name = result.found
    assert by_search == ("search", by_search.fault, expected, 40)
    assert by_name == ("named modes", Fault("FM2", 2), expected, 20)
    assert (by_search.fault.mode, by_search.fault.robots) == ("FM2", 2)
    assert (result.searched, result.is_capped) == (len(settings.faults()), False)
    of_search = [faults for faults in faults_of_runs if faults][: settings.budget]
    assert result.tried == len(set(of_search))


def test_changes_are_estimated_with_the_noise_under_which_the_runs_are_likeliest() -> None:
    rng = np.random.default_rng(0)
    covariance = 0.4 + 0.6 * np.eye(4)
    runs = np.repeat(np.arange(4), 6)
    for spread in (0.1, 0.5, 2.0):
        changes = np.array([0.0, -1.0, 2.0, 0.5])[runs] + rng.normal(0.0, spread, 24)
        normal = (changes - changes.mean()) / changes.std()
        priors = {
            noise: (covariance[np.ix_(runs, runs)] + noise * np.eye(24)) / (1.0 + noise)
            for noise in _NOISES
        }
        likeliest = max(
            _NOISES, key=lambda noise: multivariate_normal(None, priors[noise]).logpdf(normal)
        )
        across = covariance[:, runs] / (1.0 + likeliest)
        mean, _ = _posterior(covariance, runs, changes)
        expected = across @ np.linalg.solve(priors[likeliest], normal)
        np.testing.assert_allclose(mean, changes.mean() + changes.std() * expected)
