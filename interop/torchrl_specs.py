"""TorchRL: `check_env_specs` on `PettingZooWrapper`, then roll-outs across episode ends."""

from __future__ import annotations

from typing import Any

from torchrl.envs import PettingZooWrapper
from torchrl.envs.utils import check_env_specs

from interop.versions import versions
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize

N_ROBOTS = 5
MAX_CYCLES = 20
STEPS = 250


def main() -> None:
    """Check every form of the environment that TorchRL can wrap."""
    print(versions("torchrl", "tensordict", "torch", "pettingzoo", "gymnasium"))
    fields: dict[str, Any] = {"n_robots": N_ROBOTS, "max_cycles": MAX_CYCLES}
    plain = swarm_logistics_v0.parallel_env(**fields)
    check("parallel", plain)
    check("parallel, with state", swarm_logistics_v0.parallel_env(**fields), return_state=True)
    faulty = FaultInjection(swarm_logistics_v0.parallel_env(**fields), "FM1", 2, onset=0.1)
    check("parallel, 2 robots fail at 0.1 s", faulty)
    broken = FaultInjection(swarm_logistics_v0.parallel_env(**fields), "FM1", 2)
    try:
        check("parallel, 2 robots fail at 0 s", broken)
    except ValueError as error:  # infos name the failure mode; they want numbers in a reset's
        print(f"parallel, 2 robots fail at 0 s: TorchRL raises ValueError: {error}")
    shrinking = SwarmSize(swarm_logistics_v0.parallel_env(**fields), N_ROBOTS, leave=[(2, 1.0)])
    check("parallel, 2 robots leave at 1 s", shrinking, use_mask=True, done_on_any=False)
    check("AEC", swarm_logistics_v0.env(**fields), use_mask=True)
    varying = SwarmSize(swarm_logistics_v0.parallel_env(**fields), [3, N_ROBOTS])
    try:
        check("parallel, 3 or 5 robots", varying, use_mask=True, done_on_any=False)
    except KeyError as error:  # their reset asks for the row of every possible agent
        print(f"parallel, 3 or 5 robots: TorchRL raises KeyError: {error}")


def check(name: str, env: Any, **arguments: Any) -> None:
    """Compare what the specs promise with what comes, over several episodes."""
    wrapped = PettingZooWrapper(env, **arguments)
    check_env_specs(wrapped, seed=0)
    rollout = wrapped.rollout(STEPS, break_when_any_done=False)
    assert rollout.batch_size == (STEPS,), rollout.batch_size
    wrapped.close()
    episodes = int(rollout["next", "done"].sum())
    print(f"{name}: specs hold; {STEPS} steps, {episodes} episodes ended")


if __name__ == "__main__":
    main()
