"""skrl: independent PPO, a policy and a value network for each robot, on its PettingZoo wrapper."""

from __future__ import annotations

import tempfile
from typing import Any

import torch
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.multi_agents.torch.ippo import IPPO
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import nn

from interop.conditions import CONDITIONS, played
from interop.results import passes, runs_with

ROLLOUTS = 32
STEPS = 128
PARTS = (
    "learning_rate_scheduler", "observation_preprocessor", "state_preprocessor",
    "value_preprocessor",
)  # fmt: skip


class Policy(GaussianMixin, Model):  # type: ignore[misc]  # skrl is not in the gate
    """A Gaussian policy with a network of one layer."""

    def __init__(self, observation_space: Any, action_space: Any) -> None:
        Model.__init__(self, observation_space=observation_space, action_space=action_space)
        GaussianMixin.__init__(self)
        self.net = nn.Sequential(
            nn.Linear(self.num_observations, 32), nn.Tanh(), nn.Linear(32, self.num_actions)
        )
        self.log_deviation = nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs: Any, role: str = "") -> Any:
        """Return mean actions and the logarithm of their deviation."""
        return self.net(inputs["observations"]), {"log_std": self.log_deviation}


class Value(DeterministicMixin, Model):  # type: ignore[misc]  # as above
    """The value of an observation, by a network of one layer."""

    def __init__(self, observation_space: Any, action_space: Any) -> None:
        Model.__init__(self, observation_space=observation_space, action_space=action_space)
        DeterministicMixin.__init__(self)
        self.net = nn.Sequential(nn.Linear(self.num_observations, 32), nn.Tanh(), nn.Linear(32, 1))

    def compute(self, inputs: Any, role: str = "") -> Any:
        """Return the value."""
        return self.net(inputs["observations"]), {}


def main() -> None:
    """Train in every condition for a few updates."""
    runs_with("skrl", "torch", "pettingzoo", "gymnasium")
    set_seed(0)
    for name, make in CONDITIONS.items():
        with tempfile.TemporaryDirectory() as folder:
            train(name, make(), folder)


def train(name: str, env: Any, folder: str) -> None:
    """Train on one environment and check that every robot's policy has changed."""
    wrapped = wrap_env(env, wrapper="pettingzoo")
    agents = wrapped.possible_agents
    seen, told = wrapped.observation_spaces, wrapped.action_spaces
    models = {
        agent: {
            "policy": Policy(seen[agent], told[agent]),
            "value": Value(seen[agent], told[agent]),
        }
        for agent in agents
    }
    before = {agent: parameters(models[agent]["policy"]) for agent in agents}
    learner = IPPO(
        possible_agents=agents,
        models=models,
        memories={agent: RandomMemory(memory_size=ROLLOUTS) for agent in agents},
        observation_spaces=seen,
        state_spaces=wrapped.state_spaces,
        action_spaces=told,
        cfg={
            "rollouts": ROLLOUTS,
            # Its default, an empty dict for all agents, is refused by its own check.
            **{f"{part}_kwargs": {agent: {} for agent in agents} for part in PARTS},
            "experiment": {"directory": folder, "write_interval": 0, "checkpoint_interval": 0},
        },
    )
    settings = {"timesteps": STEPS, "headless": True, "disable_progressbar": True}
    SequentialTrainer(env=wrapped, agents=learner, cfg=settings).train()
    for agent in agents:
        after = parameters(models[agent]["policy"])
        assert torch.isfinite(after).all(), agent
        assert not torch.equal(after, before[agent]), agent
    passes(f"IPPO, {STEPS} steps, {STEPS // ROLLOUTS} updates, {played(name, env)}")


def parameters(model: Any) -> torch.Tensor:
    """Return all parameters of a network as one vector."""
    return torch.nn.utils.parameters_to_vector(model.parameters()).detach().clone()


if __name__ == "__main__":
    main()
