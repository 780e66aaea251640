"""Imitation of the policy `homing` by DAgger (Ross et al. 2011), before PPO goes on.

The network plays; `homing` says what it would have commanded in the network's place. The moments
that matter are rare among the rest, which is therefore thinned out.
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
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.reporting import Report
from swarm_logistics_env.train.settings import Imitation
from swarm_logistics_env.train.specification import Training
from swarm_logistics_env.train.worlds import make_worlds

Sample = tuple[NDArray[np.float32], NDArray[np.float32]]  # inputs, the outputs that homing asks for
SEEN = INPUTS.index("requested_present")


def imitate(policy: Any, training: Training, asked: Imitation) -> None:
    """Fit PPO's policy to what `homing` does; draws from torch's generator alone.

    Args:
        policy: of the learner; its network from inputs to outputs is changed.
    """
    worlds = training.replace(sizes=asked.sizes, worlds=len(asked.sizes), indicators=None)
    view = NetworkView(make_worlds(worlds), training.scenario, training.network.listens)
    optimizer = torch.optim.Adam(actor_parameters(policy), lr=asked.learning_rate)
    samples: list[Sample] = []
    with Report(f"{training.name}: imitation", asked.rounds, unit="rounds") as report:
        for number in range(asked.rounds):
            samples.append(_collected(policy, view, training, asked, number))
            is_last = number == asked.rounds - 1
            loss = _fit(policy, optimizer, samples, asked, asked.last_fit if is_last else asked.fit)
            size = sum(len(inputs) for inputs, _ in samples)
            report.reach(number + 1, f"{size:,} samples, loss {loss:.4f}")
    view.close()


def _collected(
    policy: Any, view: NetworkView, training: Training, asked: Imitation, number: int
) -> Sample:
    """Return what `homing` says in one round of play."""
    rng = generator(training.seed, "imitation", number)
    view.seed(key(training.seed, "imitation worlds", number))
    period = training.scenario.control_period
    device = next(policy.parameters()).device
    share = asked.teacher_share[number] if number < len(asked.teacher_share) else 0.0
    inputs = view.reset()
    seen, said = [], []
    for _ in range(round(asked.seconds / period)):
        commands = homing_commands(view.frame, view.observations, period)
        wanted = view.frame.outputs_for(commands).astype(np.float32)
        rows = view.observations
        matters = rows[:, row.CARRYING_REQUESTED] > 0.5
        matters |= inputs[:, SEEN] > 0.5
        matters |= view.frame.memory[:, memory.STUCK] > 0.0
        kept = (matters | (rng.random(len(rows)) < asked.common_share)) & view.venv.present
        seen.append(inputs[kept])
        said.append(wanted[kept])
        with torch.no_grad():
            own = outputs_of(policy, torch.from_numpy(inputs).to(device)).cpu().numpy()
        leads = rng.random((len(rows), 1)) < share
        noise = rng.standard_normal(own.shape) * asked.noise
        inputs, *_ = view.step(np.where(leads, wanted, own) + noise)
    return np.concatenate(seen), np.concatenate(said)


def _fit(
    policy: Any,
    optimizer: torch.optim.Optimizer,
    samples: list[Sample],
    asked: Imitation,
    steps: int,
) -> float:
    device = next(policy.parameters()).device
    inputs, wanted = (torch.from_numpy(np.concatenate(part)).to(device) for part in zip(*samples))
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
