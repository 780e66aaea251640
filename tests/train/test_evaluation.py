"""What is measured on the way: seeds of their own, and policies that remember no other episode."""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.policies.swarm_dt import SwarmDT
from swarm_logistics_env.study.questions.specification import MOST_SEEDS
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.train import evaluation
from swarm_logistics_env.train.settings import Evaluation, Scores
from swarm_logistics_env.train.training_callback import TrainingLog
from tests.conftest import PACKAGE, figures_drawn

SCENARIO = Scenario(
    n_robots=6, n_items=9, warehouse_width=3.0, warehouse_height=3.0, duration=20.0, restock=True
)


class Remembering(SwarmDT):
    """Plays ever more at random, episode after episode."""

    episodes = 0

    def reset(self, n_robots: int, seed: int) -> None:
        self.episodes += 1
        super().reset(n_robots, seed + 1000 * self.episodes)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_episode_follows_from_its_seed_alone(threads: int) -> None:
    kinds, seeds = [(), (Fault("FM2", 1),), ()], [5, 6, 5, 6, 5]
    measured = evaluation.performances(Remembering(), SCENARIO, kinds, seeds, threads)
    np.testing.assert_array_equal(measured[0], measured[2])
    np.testing.assert_array_equal(measured[:, 2:4], measured[:, :2])
    assert measured.any()


def test_no_seed_of_a_score_is_measured_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = set()

    def noted(scenario: Scenario, policy: Any, seed: int, faults: Any) -> Any:
        seeds.add(seed)
        return run_episode(scenario.replace(duration=0.5), policy, seed, faults)

    monkeypatch.setattr(evaluation, "run_episode", noted)
    settings = Evaluation(seeds=3, n_robots=6, faults={"FM1": 1})
    evaluation.evaluate(policies.load("swarm-dt"), SCENARIO, settings, threads=2)
    assert seeds == {1_000_000, 1_000_001, 1_000_002}
    assert seeds.isdisjoint(range(MOST_SEEDS))


def test_p_is_measured_on_the_way_and_of_each_fault_p_and_r(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = Evaluation(seeds=2, n_robots=6, faults={"FM1": 1, "FM4": 3})
    cases = ([40.0, 60.0], -7 / 30, -0.3), ([0.0, 0.0], math.nan, math.nan)
    for sound, r_of_fm1, r_of_fm4 in cases:
        delivered = np.array([sound, [28.0, 32.0], [12.0, 8.0]])

        def performances(_: Any, *arguments: Any, delivered: Any = delivered) -> Any:
            kinds = [(), (Fault("FM1", 1),), (Fault("FM4", 3),)]
            assert arguments == (SCENARIO, kinds, range(1_000_000, 1_000_002), 3)
            return delivered

        monkeypatch.setattr(evaluation, "performances", performances)
        means = evaluation.evaluate(policies.load("homing"), SCENARIO, settings, 3)
        assert means == pytest.approx(
            {
                "P": sum(sound) / 2, "P_FM1": 30.0, "R_FM1": r_of_fm1, "P_FM4": 10.0,
                "R_FM4": r_of_fm4,
            },
            nan_ok=True,
        )  # fmt: skip


@pytest.mark.parametrize(
    ("fields", "measures"),
    [
        (
            {"sizes": (3,), "modes": ("FM4",), "robots": (1,)},
            ["P N = 3, no fault", "P N = 3, removed, m = 1", "P N = 3, FM4, m = 1",
             "FT N = 3, FM4, m = 1", "R N = 3, FM4, m = 1"],
        ),
        ({"sizes": (3, 2), "modes": ()}, ["P N = 2", "P N = 3", "S N = 3"]),
        ({"sizes": (3,), "modes": ()}, []),
    ],
)  # fmt: skip
def test_scores_are_of_several_sizes_and_of_faults(
    fields: dict[str, Any], measures: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "policy.safetensors"
    shutil.copy(PACKAGE / "policies" / "weights" / "ppo-delivery.safetensors", path)
    settings = Scores(seeds=3, n_robots=3, **fields)
    scenario = SCENARIO.replace(n_robots=3, duration=5.0)
    scores = evaluation.evaluate_score(path, scenario, settings, threads=1)
    assert [f"{score.measure} {score.condition}" for score in scores] == measures
    if not scores:
        return
    policy = policies.load(str(path))
    p = [run_episode(scenario, policy, seed).delivered for seed in range(3)]
    (sound,) = (score for score in scores if score.condition in ("N = 3, no fault", "N = 3")
                and score.measure == "P")  # fmt: skip
    assert sound.value == pytest.approx(np.mean(p))
    assert sound.seeds == 3
    assert sound.low is not None
    assert sound.high is not None
    assert sound.low < sound.value < sound.high
    assert Study.stored(tmp_path / "scores").specification.name == "scores-policy"


@pytest.mark.unmeasured
def test_the_best_evaluation_is_the_highest_and_the_curve_is_written(tmp_path: Path) -> None:
    rows = [(0, 1.0), (500, 40.0), (1000, 90.0), (1500, 80.0)]
    log = TrainingLog(
        [{"agent_steps": steps, "P": p} for steps, p in rows],
        {"swarm-dt": {"P": 37.0}, "homing": {"P": 146.0}},
    )
    sentence = log.sentence({"P": 49.5, "R_FM4": 0.25})
    assert sentence == "P = 49.5 (swarm-dt 37, homing 146), R_FM4 = 0.25"
    assert log.best["agent_steps"] == 1000
    log.write(tmp_path)
    with (tmp_path / "curve.csv").open(newline="") as file:
        assert [float(row["P"]) for row in csv.DictReader(file)] == [1.0, 40.0, 90.0, 80.0]
    pytest.importorskip("matplotlib")
    with figures_drawn():
        log.draw(tmp_path / "curve.png", "ppo", seeds=4)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
