"""Trainings of a few hundred steps; nothing here runs where torch is not installed."""

from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.train import Training
from swarm_logistics_env.train.settings import Evaluation, PPOSettings, Scores


@pytest.fixture(scope="session")
def small() -> Any:
    """Return a maker of trainings that take a second."""

    def made(**fields: Any) -> Training:
        defaults: dict[str, Any] = {
            "name": "small",
            "scenario": Scenario(
                warehouse_width=5.0, warehouse_height=4.0, n_items=8, duration=6.0, restock=True
            ),
            "worlds": [{"n_robots": 3}, {"n_robots": 5}],
            "threads": 1,
            "agent_steps": 640,
            "network": Network(hidden=(8,)),
            "ppo": PPOSettings(n_steps=20, n_minibatches=2, epochs=2, value_hidden=(8,)),
            "evaluation": Evaluation(every=320, seeds=1, n_robots=3, faults={"FM4": 1}),
            "scores": Scores(seeds=0),
            "rewards": {"delivery": 1.0, "contact": -0.1},
        }
        return Training(**{**defaults, **fields})

    return made
