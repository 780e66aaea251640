"""The environment in the registries of PettingZoo and Gymnasium."""

from __future__ import annotations

import subprocess
import sys

import gymnasium
import pettingzoo
import pytest

from swarm_logistics_env.environment import registration
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv


def test_gymnasium_makes_it_by_name_after_a_bare_import() -> None:
    script = (
        "import gymnasium, swarm_logistics_env, sys;"
        "assert 'swarm_logistics_env.environment.parallel_env' not in sys.modules;"
        "print(gymnasium.make('SwarmLogistics-v0', n_robots=4).observation_space.shape[0])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["4"]


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo has no registry yet")
def test_pettingzoo_makes_both_forms_by_name() -> None:
    parallel = pettingzoo.make("parallel", "swarm_logistics_v0", n_robots=3, max_cycles=7)
    assert isinstance(parallel, SwarmLogisticsEnv)
    assert parallel.max_cycles == 7
    aec = pettingzoo.make("aec", "swarm_logistics_v0", n_robots=3)
    assert isinstance(aec, pettingzoo.AECEnv)
    assert aec.possible_agents == ["robot_0", "robot_1", "robot_2"]


def test_registering_twice_is_harmless() -> None:
    before = gymnasium.registry[registration.GYMNASIUM_ID]
    registration.register()
    assert gymnasium.registry[registration.GYMNASIUM_ID] is before
