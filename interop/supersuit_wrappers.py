"""SuperSuit: frame stacking, padding and black death around the parallel and the AEC form."""

from __future__ import annotations

from typing import Any

import supersuit
from mpe2 import simple_spread_v3
from pettingzoo.test import api_test, parallel_api_test

from interop.conditions import CONDITIONS, played
from interop.results import fails_on_mpe2_too, passes, runs_with
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import SwarmSize

FRAMES = 4
MAX_CYCLES = 50
FIELDS: dict[str, Any] = {"n_robots": 5, "max_cycles": MAX_CYCLES}


def main() -> None:
    """Run PettingZoo's own API tests on the wrapped environments."""
    runs_with("supersuit", "pettingzoo", "gymnasium")
    plain = swarm_logistics_v0.parallel_env(**FIELDS)
    width = plain.observation_space("robot_0").shape[0]

    def stacked(env: Any) -> Any:
        return supersuit.frame_stack_v1(env, FRAMES)

    def padded(env: Any) -> Any:
        return supersuit.pad_action_space_v0(supersuit.pad_observations_v0(env))

    for name, wrap, shape in (
        ("frame_stack_v1", stacked, (FRAMES * width,)),
        ("pad_observations_v0, pad_action_space_v0", padded, (width,)),
    ):
        env = wrap(swarm_logistics_v0.parallel_env(**FIELDS))
        observations, _ = env.reset(seed=0)
        assert {row.shape for row in observations.values()} == {shape}, observations
        parallel_api_test(env, num_cycles=200)
        passes(f"{name}, parallel: parallel_api_test passes, rows of shape {shape}")
        api_test(wrap(swarm_logistics_v0.env(**FIELDS)), num_cycles=200)
        passes(f"{name}, AEC: api_test passes")

    leaving = SwarmSize(swarm_logistics_v0.parallel_env(**FIELDS), 5, leave=[(2, 1.0)])
    theirs = simple_spread_v3.parallel_env(max_cycles=MAX_CYCLES)
    steps, their_steps = steps_of_black_death(leaving), steps_of_black_death(theirs)
    assert steps == their_steps == MAX_CYCLES + 1, (steps, their_steps)
    what = "black_death_v3, 2 robots leave, ends one step too late"
    proof = f"{steps} steps of {MAX_CYCLES}; MPE2: {their_steps} steps of {MAX_CYCLES}"
    fails_on_mpe2_too(what, proof)

    for name, make in CONDITIONS.items():
        env = make()
        vector = supersuit.pettingzoo_env_to_vec_env_v1(env)
        vector.reset(seed=0)
        for _ in range(200):
            rows, *_ = vector.step([vector.action_space.sample()] * vector.num_envs)
            assert rows.shape == (5, width), rows.shape
        passes(f"pettingzoo_env_to_vec_env_v1, 200 steps, {played(name, env)}")


def steps_of_black_death(env: Any) -> int:
    """Return how many steps an episode has with `black_death_v3` around the environment."""
    constant = supersuit.black_death_v3(env)
    constant.reset(seed=0)
    steps = 0
    while constant.agents:
        assert constant.agents == env.possible_agents, constant.agents
        constant.step({name: env.action_space(name).sample() for name in constant.agents})
        steps += 1
    return steps


if __name__ == "__main__":
    main()
