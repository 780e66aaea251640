"""TorchRL: a collector with a policy network gathers batches across episode ends."""

from __future__ import annotations

from typing import Any

import torch
from tensordict.nn import TensorDictModule
from torchrl.collectors import Collector
from torchrl.envs import PettingZooWrapper
from torchrl.modules import MultiAgentMLP

from interop.conditions import CONDITIONS, played
from interop.results import passes, runs_with

BATCH = 100
FRAMES = 300


def main() -> None:
    """Collect in every condition."""
    runs_with("torchrl", "tensordict", "torch", "pettingzoo", "gymnasium")
    torch.manual_seed(0)
    for name, make in CONDITIONS.items():
        collect(name, make())


def collect(name: str, env: Any) -> None:
    """Collect with one network for all robots, and check what came."""
    wrapped = PettingZooWrapper(env, group_map={"robots": env.possible_agents})
    n_inputs = wrapped.observation_spec["robots", "observation"].shape[-1]
    n_outputs = wrapped.full_action_spec["robots", "action"].shape[-1]
    network = MultiAgentMLP(
        n_agent_inputs=n_inputs,
        n_agent_outputs=n_outputs,
        n_agents=len(env.possible_agents),
        centralized=False,
        share_params=True,
        depth=1,
        num_cells=32,
        activation_class=torch.nn.Tanh,
    )
    policy = TensorDictModule(
        network, in_keys=[("robots", "observation")], out_keys=[("robots", "action")]
    )
    collector = Collector(wrapped, policy, frames_per_batch=BATCH, total_frames=FRAMES)
    steps, ended = 0, 0
    for batch in collector:
        assert torch.isfinite(batch["robots", "observation"]).all()
        assert "fail" not in name or batch["robots", "info", "failed"].any()
        steps += batch.numel()
        ended += int(batch["next", "done"].sum())
    collector.shutdown()
    assert steps == FRAMES, steps
    assert ended, "no episode ended"
    passes(f"collector, {steps} steps, {ended} episodes ended, {played(name, env)}")


if __name__ == "__main__":
    main()
