"""TorchRL: `check_env_specs` on each form of the environment, and roll-outs across episodes."""

from __future__ import annotations

from typing import Any

from torchrl.envs import GymEnv, PettingZooWrapper
from torchrl.envs.utils import check_env_specs

from interop.conditions import (
    CONDITIONS,
    MAX_CYCLES,
    N_ROBOTS,
    plain,
    played,
    without_fixed_agents,
)
from interop.mpe2_swarm import FewerAgents
from interop.results import fails_on_mpe2_too, passes, runs_with, same_line
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import SwarmSize

STEPS = 250


def main() -> None:
    """Check every form of the environment that TorchRL can wrap."""
    runs_with("torchrl", "tensordict", "torch", "pettingzoo", "gymnasium")
    fields: dict[str, Any] = {"n_robots": N_ROBOTS, "max_cycles": MAX_CYCLES}
    passes(f"parallel: {checked(PettingZooWrapper(plain()))}")
    leaving = SwarmSize(plain(), N_ROBOTS, leave=[(2, 1.0)])
    wrapped = PettingZooWrapper(leaving, use_mask=True, done_on_any=False)
    passes(f"parallel, use_mask, 2 robots leave at 1 s: {checked(wrapped)}")
    for name, make in CONDITIONS.items():
        env = make()
        outcome = checked(PettingZooWrapper(env, return_state=True))
        passes(f"parallel, return_state, {played(name, env)}: {outcome}")
    aec = PettingZooWrapper(swarm_logistics_v0.env(**fields), use_mask=True)
    passes(f"AEC, use_mask: {checked(aec)}")
    passes(f"GymEnv, all robots as one agent: {checked(GymEnv('SwarmLogistics-v0', **fields))}")
    proof = same_line(
        lambda: checked(PettingZooWrapper(without_fixed_agents(N_ROBOTS), use_mask=True)),
        lambda: checked(PettingZooWrapper(FewerAgents(), use_mask=True)),
    )
    fails_on_mpe2_too("parallel, sizes that change, without FixedAgents", proof)


def checked(wrapped: Any) -> str:
    """Compare what the specs promise with what comes, over several episodes."""
    check_env_specs(wrapped, seed=0)
    rollout = wrapped.rollout(STEPS, break_when_any_done=False)
    assert rollout.batch_size == (STEPS,), rollout.batch_size
    wrapped.close()
    return f"specs hold, {STEPS} steps, {int(rollout['next', 'done'].sum())} episodes ended"


if __name__ == "__main__":
    main()
