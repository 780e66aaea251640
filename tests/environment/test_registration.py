"""The environment in the registries of PettingZoo and Gymnasium."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv


@pytest.mark.parametrize(
    ("imported", "name"),
    [
        ("gymnasium, swarm_logistics_env", "SwarmLogistics-v0"),
        ("gymnasium", "swarm_logistics_env:SwarmLogistics-v0"),
    ],
)
def test_gymnasium_makes_it_by_name_after_a_bare_import(imported: str, name: str) -> None:
    script = (
        f"import sys, {imported};"
        "assert 'swarm_logistics_env.environment.parallel_env' not in sys.modules;"
        f"print(gymnasium.make({name!r}, n_robots=4).observation_space.shape[0])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["4"]


MODES = ["NextStep", "SameStep", "Disabled"] if hasattr(gymnasium.vector, "AutoresetMode") else []


@pytest.mark.parametrize("mode", [None, *MODES])  # Gymnasium 1.1 has modes
@pytest.mark.parametrize("flat", [False, True])
def test_gymnasium_makes_several_at_once(flat: bool, mode: str | None) -> None:
    fields: Any = {"n_robots": 3, "duration": 0.3, "flat": flat}
    kwargs: Any = {"vector_kwargs": {"autoreset_mode": mode}} if mode else {}
    vector: Any = gymnasium.make_vec("SwarmLogistics-v0", num_envs=2, **fields, **kwargs)
    alone: Any = gymnasium.make("SwarmLogistics-v0", **fields)
    first, _ = vector.reset(seed=[4, 5])
    for place in range(2):
        assert alone.reset(seed=4 + place)[0].tobytes() == first[place].tobytes()
    for step in range(3):
        rows, _, _, cut, infos = vector.step(vector.action_space.sample())
        assert cut.tolist() == [step == 2] * 2
    assert infos["failed"].shape == (2, 3)
    assert ("final_obs" in infos) == (mode == "SameStep")
    if mode == "Disabled":
        rows, _ = vector.reset(seed=[4, 5], options={"reset_mask": np.array([True, False])})
        assert rows[0].tobytes() == first[0].tobytes()
    else:
        rows, _, _, cut, _ = vector.step(vector.action_space.sample())
        assert not cut.any()
    assert rows.shape == (2, *alone.observation_space.shape)
    vector.close()


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo has no registry yet")
def test_pettingzoo_makes_both_forms_by_name() -> None:
    parallel = pettingzoo.make("parallel", "swarm_logistics_v0", n_robots=3, max_cycles=7)
    assert isinstance(parallel, SwarmLogisticsEnv)
    assert parallel.max_cycles == 7
    aec = pettingzoo.make("aec", "swarm_logistics_v0", n_robots=3)
    assert isinstance(aec, pettingzoo.AECEnv)
    assert aec.possible_agents == ["robot_0", "robot_1", "robot_2"]
