from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("optuna")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env import policies
from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.reward_search import RewardSearch, search_rewards, weighted, weights
from swarm_logistics_env.train.settings import Indicators


def test_a_search_that_was_killed_goes_on_within_its_trial(
    small: Any, tmp_path: Path, stopped_after: Any
) -> None:
    asked = RewardSearch(training=small(agent_steps=320), trials=2)
    whole = search_rewards(asked, tmp_path / "whole")
    stopped_after(2, lambda: search_rewards(asked, tmp_path / "cut"))
    cut = search_rewards(asked, tmp_path / "cut")
    assert [(t.parameters, t.values) for t in cut] == [(t.parameters, t.values) for t in whole]
    assert set(cut[0].parameters.values()) == {1.0}
    with (tmp_path / "cut" / "front.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["P"]) for row in rows] == [trial.values[0] for trial in whole]
    assert "True" in {row["is_on_front"] for row in rows}
    factor = float(rows[1]["rewards.delivery"])
    learned_with = policies.read_card(Path(rows[1]["policy"])).training
    assert learned_with["rewards"]["delivery"] == pytest.approx(factor * 1.0)


def test_weights_of_rewards_and_indicators_are_changed_alike(small: Any) -> None:
    training = small(rewards={"contact": -0.1, "approach": 0.0}, indicators={"weights": {"R": 2.0}})
    assert weights(training) == {"rewards.contact": -0.1, "indicators.R": 2.0}
    changed = weighted(training, {"rewards.contact": 0.5, "indicators.R": 3.0})
    assert changed.rewards == {"contact": -0.05}
    assert changed.indicators == Indicators(weights={"R": 6.0})


def test_a_training_that_measures_no_robustness_is_refused(small: Any) -> None:
    evaluation = small().evaluation.replace(faults={})
    with pytest.raises(TrainingError, match=r"evaluation\.faults: should name the modes"):
        RewardSearch(training=small(evaluation=evaluation))
