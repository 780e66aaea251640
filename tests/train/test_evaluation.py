"""What is measured on the way: seeds of their own, and policies that remember no other episode."""

from __future__ import annotations

import csv
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
    assert len(seeds) == 3
    assert seeds.isdisjoint(range(MOST_SEEDS))


@pytest.mark.parametrize(
    ("fields", "conditions"),
    [
        (
            {"sizes": (3,), "modes": ("FM4",), "robots": (1,)},
            {"N = 3, no fault", "N = 3, FM4, m = 1", "N = 3, removed, m = 1"},
        ),
        ({"sizes": (2, 3), "modes": ()}, {"N = 2", "N = 3"}),
        ({"sizes": (3,), "modes": ()}, set()),
    ],
)
def test_scores_are_of_several_sizes_and_of_faults(
    fields: dict[str, Any], conditions: set[str], tmp_path: Path
) -> None:
    path = tmp_path / "policy.safetensors"
    shutil.copy(PACKAGE / "policies" / "weights" / "ppo-delivery.safetensors", path)
    settings = Scores(seeds=1, n_robots=3, **fields)
    scenario = SCENARIO.replace(n_robots=3, duration=10.0)
    scores = evaluation.evaluate_score(path, scenario, settings, threads=1)
    assert {score.condition for score in scores if score.measure == "P"} == conditions


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
