"""What networks read in trainings, and what they are paid, as recorded: means of each column."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.train.privileged import PRIVILEGED
from swarm_logistics_env.train.training_worlds import NetworkView
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.network_inputs import input_names
from swarm_logistics_env.world.motion.voices import MESSAGES
from tests.conftest import Check

TERMS = {
    "delivery": 1.0, "own_delivery": 0.5, "lift_requested": 0.3, "approach": 0.2, "stocking": 0.1,
    "held_inside": 0.3, "contact": -0.1, "collision": -0.2, "blocked_request": -0.5,
}  # fmt: skip
KINDS: list[dict[str, Any]] = [
    {"modes": ["FM1", "FM4", "motor_slow"], "robots": [1, 2], "onset": [0.0, 3.0]},
    {"weight": 0.5, "scenario": {"max_speed": [0.5, 1.5], "n_requests": [2]}},
    {"modes": ["removed"], "robots": [1, 2]},
]
TALKING = Network(hidden=(8,), head="classes", role=True, talks=True, decides_every=2)
N_STEPS = 50


def trainings(small: Any) -> dict[str, Any]:
    """Return trainings by a name."""
    scenario = small().scenario
    talking = scenario.replace(message_size=2, drive="differential", n_requests=2)
    weights = {"S": 0.5, "R": 1.0, "FT": 0.3, "A": 0.2, "P": 0.1}
    return {
        "plain": small(
            network=Network(hidden=(8,), sees_items=True),
            rewards=TERMS,
            scenario=scenario.replace(handling_time=0.2),
        ),
        "with a teacher": small(
            network=TALKING,
            scenario=talking,
            teacher={"policy": "homing-stock", "pull": 0.1},
            conditions=KINDS[:2],
            rewards=TERMS,
        ),
        "paid by indicators": small(
            indicators={"weights": weights, "references": "measured"},
            conditions=[KINDS[0], KINDS[2], {}],
        ),
    }


def test_views_are_as_recorded(small: Any, check_recorded: Check) -> None:
    lines = []
    for name, training in trainings(small).items():
        network = training.network
        view = NetworkView(training)
        view.seed(5)
        read = [view.reset()]
        paid = []
        rng = np.random.default_rng(1)
        for _ in range(N_STEPS):
            along = 0.7 + 0.3 * rng.standard_normal(view.num_envs)
            aside = 0.4 * rng.standard_normal(view.num_envs)
            if network.talks:
                view.take_messages(rng.random((view.num_envs, 2)).astype(np.float32))
            view.give_outputs(np.column_stack([along, aside, np.ones(view.num_envs)]))
            rows, rewards, _, _ = view.step_wait()
            read.append(rows)
            paid.append(rewards)
        names = [*input_names(**network.reads), *PRIVILEGED._fields]
        names += [f"true {message}" for message in MESSAGES] if network.talks else []
        names += [f"label of {output}" for output in OUTPUTS] if training.teacher else []
        columns = np.stack(read).astype(float)
        assert columns.shape[2] == len(names)
        of_rows = columns.mean(axis=(0, 1)), np.abs(columns).mean(axis=(0, 1))
        for column, mean, size in zip(names, *of_rows, strict=True):
            lines.append(f"{name}: {column} {mean:.4f} {size:.4f}")
        of_robots = " ".join(f"{total:.4f}" for total in np.stack(paid).sum(axis=0))
        lines.append(f"{name}: rewards {of_robots}")
    check_recorded("views.txt", lines)
