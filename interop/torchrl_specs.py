"""TorchRL: `check_env_specs` on each form of the environment, and roll-outs across episodes."""

from __future__ import annotations

from typing import Any

from torchrl.envs import GymEnv, PettingZooWrapper
from torchrl.envs.utils import check_env_specs

from interop.conditions import CONDITIONS, MAX_CYCLES, N_ROBOTS, plain, played
from interop.versions import versions
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import SwarmSize

STEPS = 250


def main() -> None:
    """Check every form of the environment that TorchRL can wrap."""
    print(versions("torchrl", "tensordict", "torch", "pettingzoo", "gymnasium"))
    fields: dict[str, Any] = {"n_robots": N_ROBOTS, "max_cycles": MAX_CYCLES}
    checked("parallel", PettingZooWrapper(plain()))
    checked("parallel, with state", PettingZooWrapper(plain(), return_state=True))
    leaving = SwarmSize(plain(), N_ROBOTS, leave=[(2, 1.0)])
    masked = {"use_mask": True, "done_on_any": False}
    checked("parallel, 2 robots leave at 1 s", PettingZooWrapper(leaving, **masked))
    for name, make in CONDITIONS.items():
        env = make()
        checked("parallel", PettingZooWrapper(env, return_state=True))
        print(played(name, env))
    checked("AEC", PettingZooWrapper(swarm_logistics_v0.env(**fields), use_mask=True))
    checked("all robots as one agent, GymEnv", GymEnv("SwarmLogistics-v0", **fields))


def checked(name: str, wrapped: Any) -> None:
    """Compare what the specs promise with what comes, over several episodes."""
    check_env_specs(wrapped, seed=0)
    rollout = wrapped.rollout(STEPS, break_when_any_done=False)
    assert rollout.batch_size == (STEPS,), rollout.batch_size
    wrapped.close()
    episodes = int(rollout["next", "done"].sum())
    print(f"{name}: specs hold; {STEPS} steps, {episodes} episodes ended")


if __name__ == "__main__":
    main()
