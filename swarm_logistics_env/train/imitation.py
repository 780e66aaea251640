"""Imitation of the policy `homing` by DAgger (Ross et al. 2011), before PPO goes on.

The network plays; `homing`, the expert, says what it would have commanded instead. The moments that
matter are rare, so only a share of the others is kept as demonstrations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.motion import memory
from swarm_logistics_env.motion.frame import INPUTS
from swarm_logistics_env.policies.homing import homing_commands
from swarm_logistics_env.streams import generator, key
from swarm_logistics_env.train.learner import actor_parameters, outputs_of
from swarm_logistics_env.train.live_table import LiveTable
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.settings import Imitation, WorldKind
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.training_worlds import make_worlds

# Inputs (K, len(INPUTS)) and the outputs (K, len(OUTPUTS)) that the expert asks for.
Demonstrations = tuple[NDArray[np.float32], NDArray[np.float32]]
SEEN = INPUTS.index("requested_present")


def imitate(policy: Any, training: Training, asked: Imitation) -> None:
    """Fit PPO's policy to demonstrations of `homing`; draws from torch's generator alone.

    Args:
        policy: of the learner; its network from inputs to outputs is changed.
    """
    kinds = tuple(WorldKind(n_robots=size) for size in asked.sizes)
    worlds = training.replace(worlds=kinds, indicators=None)
    view = NetworkView(make_worlds(worlds), training.scenario, training.network.listens)
    optimizer = torch.optim.Adam(actor_parameters(policy), lr=asked.learning_rate)
    demonstrations: list[Demonstrations] = []
    with LiveTable(f"{training.name}: imitation", asked.rounds, "rounds") as table:
        for number in range(asked.rounds):
            demonstrations.append(_collect(policy, view, training, asked, number))
            is_last = number == asked.rounds - 1
            steps = asked.last_fit if is_last else asked.fit
            loss = _fit(policy, optimizer, demonstrations, asked, steps)
            size = sum(len(inputs) for inputs, _ in demonstrations)
            table.reach(number + 1)
            table.measured({"demonstrations": size, "loss": loss})
    view.close()


def _collect(
    policy: Any, view: NetworkView, training: Training, asked: Imitation, number: int
) -> Demonstrations:
    """Return the demonstrations of one round of play."""
    rng = generator(training.seed, "imitation", number)
    view.seed(key(training.seed, "imitation worlds", number))
    period = training.scenario.control_period
    device = next(policy.parameters()).device
    beta = asked.beta[number] if number < len(asked.beta) else 0.0
    inputs = view.reset()
    seen, demonstrated = [], []
    for _ in range(round(asked.seconds / period)):
        commands = homing_commands(view.frame, view.observations, period)
        wanted = view.frame.outputs_for(commands).astype(np.float32)
        rows = view.observations
        matters = rows[:, row.CARRYING_REQUESTED] > 0.5
        matters |= inputs[:, SEEN] > 0.5
        matters |= view.frame.memory[:, memory.STUCK] > 0.0
        kept = (matters | (rng.random(len(rows)) < asked.common_share)) & view.venv.present
        seen.append(inputs[kept])
        demonstrated.append(wanted[kept])
        with torch.no_grad():
            own = outputs_of(policy, torch.from_numpy(inputs).to(device)).cpu().numpy()
        is_expert = rng.random((len(rows), 1)) < beta
        noise = rng.standard_normal(own.shape) * asked.noise
        inputs, *_ = view.step(np.where(is_expert, wanted, own) + noise)
    return np.concatenate(seen), np.concatenate(demonstrated)


def _fit(
    policy: Any,
    optimizer: torch.optim.Optimizer,
    demonstrations: list[Demonstrations],
    asked: Imitation,
    steps: int,
) -> float:
    device = next(policy.parameters()).device
    inputs, wanted = (
        torch.from_numpy(np.concatenate(part)).to(device) for part in zip(*demonstrations)
    )
    # A wrong gripper costs less than a wrong way: it has a dead band.
    weights = torch.tensor([1.0, 1.0, 0.5], device=device)
    loss = torch.zeros(())
    for step in range(steps):
        slower = 1.0 if step < 0.7 * steps else 0.2
        for group in optimizer.param_groups:
            group["lr"] = slower * asked.learning_rate
        chosen = torch.randint(len(inputs), (asked.batch,), device=device)
        errors = outputs_of(policy, inputs[chosen]) - wanted[chosen]
        loss = (weights * errors**2).sum(dim=1).mean()
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]  # torch leaves it untyped
        optimizer.step()
    return float(loss.item())
