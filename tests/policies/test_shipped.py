from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.train.training import load_training, preset_names
from swarm_logistics_env.world.warehouse import Fault

pytestmark = pytest.mark.unmeasured

SHIPPED = sorted(path.stem for path in WEIGHTS.glob("*.safetensors"))


def test_each_is_a_training_of_a_preset_and_the_median_one_has_its_name() -> None:
    recipes = {name.partition("@")[0] for name in SHIPPED}
    assert recipes <= {load_training(name).name for name in preset_names()}
    assert recipes <= set(SHIPPED)
    seeds = [(card.name, card.seed) for card in map(policies.read_card, WEIGHTS.glob("*"))]
    assert len(set(seeds)) == len(seeds), "every training once"


@pytest.mark.parametrize("name", SHIPPED)
def test_they_are_small_and_say_how_they_were_made(name: str) -> None:
    file = WEIGHTS / f"{name}.safetensors"
    card = policies.read_card(file)
    assert file.stat().st_size < 1_000_000
    assert card.name == name.partition("@")[0]
    assert "@" not in name or name.endswith(f"@{card.seed}")
    assert "/tmp" not in json.dumps(card.model_dump(mode="json"))
    assert card.scores
    assert all(score.low is not None and score.low <= score.value for score in card.scores)
    recipe = card.name.removeprefix("ppo-")
    seed = f" --seed {card.seed}" if card.seed else ""
    assert card.command == f"swarm-logistics train {recipe}{seed}"
    preset = load_training(recipe, seed=card.seed)
    assert preset.model_dump(mode="json", exclude_defaults=True) == card.training


@cache
def delivered(name: str, *faults: Fault, **fields: Any) -> float:
    """Return the mean of what a policy delivers over some seeds."""
    policy, scenario = policies.load(name), Scenario(restock=True, duration=80.0, **fields)
    episodes = (run_episode(scenario, policy, seed, faults) for seed in range(4))
    return float(np.mean([episode.delivered for episode in episodes]))


@pytest.mark.parametrize(
    ("name", "n_robots"),
    [
        *((name, n_robots) for name in SHIPPED if "@" not in name for n_robots in (5, 30)),
        *(pytest.param(name, 30, marks=pytest.mark.daily) for name in SHIPPED if "@" in name),
    ],
)
def test_they_deliver_more_than_swarm_dt(name: str, n_robots: int) -> None:
    assert delivered(name, n_robots=n_robots) > 1.5 * delivered("swarm-dt", n_robots=n_robots)


def test_a_drift_costs_little_and_robust_lets_go_of_what_it_cannot_deliver() -> None:
    slow, fast = (delivered("ppo-delivery", heading_drift=drift) for drift in (0.0, 0.1))
    assert fast > 0.5 * slow
    fault = Fault("FM4", 2)
    assert delivered("ppo-robust", fault) > 1.4 * delivered("swarm-dt", fault)
