from __future__ import annotations

import json

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.policies.loading import WEIGHTS
from swarm_logistics_env.warehouse import Fault

SHIPPED = sorted(path.stem for path in WEIGHTS.glob("*.safetensors"))
SHORT = Scenario(restock=True, duration=100.0)


def test_there_is_one_for_each_preset_of_training() -> None:
    assert SHIPPED == ["ppo-delivery", "ppo-indicator", "ppo-robust"]


@pytest.mark.parametrize("name", SHIPPED)
def test_they_are_small_and_say_how_they_were_made(name: str) -> None:
    file = WEIGHTS / f"{name}.safetensors"
    card = policies.read_card(file)
    assert file.stat().st_size < 1_000_000
    assert card.name == name
    assert card.command.startswith("swarm-logistics train ")
    assert "/tmp" not in json.dumps(card.model_dump(mode="json"))
    assert card.scores
    assert all(score.low is not None and score.low <= score.value for score in card.scores)


# ppo-robust listens to no timer and its memory fades: in a crowd it finds the delivery area as late
# as Swarm D-T does.
@pytest.mark.parametrize(
    ("name", "n_robots"),
    [(name, n) for name in SHIPPED for n in (5, 40) if (name, n) != ("ppo-robust", 40)],
)
def test_they_deliver_more_than_swarm_dt(name: str, n_robots: int) -> None:
    scenario = SHORT.replace(n_robots=n_robots)
    ours, scripted = (
        np.mean([run_episode(scenario, policies.load(which), seed).delivered for seed in range(8)])
        for which in (name, "swarm-dt")
    )
    assert ours > 1.5 * scripted


def test_delivery_learned_from_nothing() -> None:
    training = policies.read_card(WEIGHTS / "ppo-delivery.safetensors").training
    assert not {"imitation", "start"} & training.keys()


def test_robust_lets_go_of_what_it_cannot_deliver() -> None:
    faults = [Fault("FM4", 2)]
    ours, scripted = (
        np.mean(
            [run_episode(SHORT, policies.load(which), seed, faults).delivered for seed in range(8)]
        )
        for which in ("ppo-robust", "swarm-dt")
    )
    assert ours > 1.4 * scripted
