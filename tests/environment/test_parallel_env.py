"""The PettingZoo view of a warehouse."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import data_equivalence
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, swarm_logistics_v0
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.adapters.swarm_logistics_v0 import parallel_env
from swarm_logistics_env.core.errors import ArgumentError, CommandError, ScenarioError, SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import gather_commands
from swarm_logistics_env.environment.spaces import agent_names
from swarm_logistics_env.wrappers import FaultInjection
from tests.wrappers.conftest import eastward

# Everything is in reach of everybody, so that whoever drives east delivers.
REACHABLE = Scenario(n_robots=2, n_items=1, pickup_range=14.0, duration=60.0)


def still(env: SwarmLogisticsEnv) -> dict[str, NDArray[np.float32]]:
    return {agent: np.zeros(4, np.float32) for agent in env.agents}


def east(env: SwarmLogisticsEnv) -> dict[str, NDArray[np.float64]]:
    """Return commands that hold on and drive to the delivery area."""
    commands = eastward(env)
    return {agent: commands[int(agent[6:])] for agent in env.agents}


@pytest.mark.parametrize("make", [swarm_logistics_v0.env, swarm_logistics_v0.raw_env])
def test_the_constructors_of_the_sequential_form_make_it(make: Any) -> None:
    aec = make(n_robots=2)
    aec.reset(seed=0)
    assert aec.agents == ["robot_0", "robot_1"]


@pytest.mark.skipif(not hasattr(pettingzoo, "make"), reason="PettingZoo has no registry yet")
def test_pettingzoo_makes_both_forms_by_name() -> None:
    parallel = pettingzoo.make("parallel", "swarm_logistics_v0", n_robots=3, max_cycles=7)
    assert isinstance(parallel, SwarmLogisticsEnv)
    assert parallel.max_cycles == 7
    assert pettingzoo.make("aec", "swarm_logistics_v0", n_robots=3).max_num_agents == 3


def test_actions_may_be_given_in_any_order_and_beyond_their_bounds() -> None:
    first, second = parallel_env(n_robots=2), parallel_env(n_robots=2)
    for env in (first, second):
        env.reset(seed=1)
    far: Any = {"robot_1": np.array([0.1, 0.2, 0.3, 0.4]), "robot_0": [7.0, 0.0, -3.0, 9.0]}
    cut = {"robot_0": np.array([1.0, 0.0, -1.0, 1.0]), "robot_1": far["robot_1"]}
    assert data_equivalence(first.step(far), second.step(cut))


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"robot_0": np.zeros(3)}, r"command of 'robot_0' of shape \(3,\): should be \(4,\)"),
        ({"robot_0": ["a"] * 4}, "commands should be numbers"),
        ({"robot_1": [0, np.nan, 0, 0]}, r"\[1, 1\] = nan: should be finite"),
    ],
)
def test_wrong_commands_are_refused_and_nothing_has_happened(
    change: dict[str, Any], complaint: str
) -> None:
    env, undisturbed = parallel_env(n_robots=2), parallel_env(n_robots=2)
    env.reset(seed=0)
    undisturbed.reset(seed=0)
    with pytest.raises(CommandError, match=complaint):
        env.step({**still(env), **change})
    with pytest.raises(CommandError, match="actions of type list: should be a dict"):
        env.step([np.zeros(4)])  # type: ignore[arg-type]
    assert env.agents == ["robot_0", "robot_1"]
    assert data_equivalence(env.step(still(env)), undisturbed.step(still(undisturbed)))


class OnGPU:
    """What a tensor on another device does when NumPy asks for it."""

    dtype, device, requires_grad, shape = "torch.float32", "cuda:0", False, (4,)

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("can't convert cuda:0 device type tensor to numpy.")


def tensor(dtype: str = "float32", **arguments: Any) -> Any:
    torch = pytest.importorskip("torch")
    return torch.zeros(4, dtype=getattr(torch, dtype), **arguments)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: tensor("bfloat16"), "Tensor cannot be read.* BFloat16"),
        (lambda: tensor(requires_grad=True), "Tensor cannot be read.* requires grad"),
        (OnGPU, "OnGPU cannot be read.* cuda:0"),
    ],
)
def test_what_cannot_be_read_is_refused(make: Callable[[], Any], reason: str) -> None:
    env, central = parallel_env(n_robots=2), CentralEnv(n_robots=1)
    env.reset(seed=0)
    central.reset(seed=0)
    actions: dict[str, Any] = {"robot_0": np.zeros(4), "robot_1": make()}
    with pytest.raises(CommandError, match=f"command of 'robot_1' of type {reason}"):
        list(map(env.step, [actions] * 3))
    with pytest.raises(CommandError, match="cannot be read"):
        list(env.step(actions) for _ in range(3))  # noqa: C400  # no loop swallows it
    with pytest.raises(CommandError, match=f"commands of type {reason}"):
        env.step_arrays(make())
    with pytest.raises(CommandError, match=f"action of type {reason}"):
        central.step(make())
    assert env.warehouse.state.step == 0


def test_a_name_among_many_is_told() -> None:
    names = agent_names(range(100_000))
    actions = dict.fromkeys(names, np.zeros(4))
    with pytest.raises(CommandError, match=r"a command for 'robot_x', .* 100000 possible agents"):
        gather_commands({**actions, "robot_x": np.zeros(4)}, names, names, (4,))
    del actions["robot_99999"]
    with pytest.raises(CommandError, match="no command for 'robot_99999'"):
        gather_commands(actions, names, names, (4,))


@pytest.mark.parametrize(
    ("arguments", "error", "complaint"),
    [
        ({"n_robot": 3}, ScenarioError, "did you mean 'n_robots'"),
        ({"render_mode": "hologram"}, SetupError, "render_mode = 'hologram': should be"),
        ({"scenario": {"n_robots": 3}}, SetupError, "scenario = .*: should be a Scenario"),
        ({"num_agents": 3}, ArgumentError, "'num_agents'; known: announced, battery, bodies, "),
        ({"max_robots": 24}, SetupError, "max_robots = 24: should be .* of at least 25"),
        ({"max_cycles": 0}, SetupError, "max_cycles = 0: should be a whole number"),
        ({"rewards": ["delivery"]}, SetupError, r"rewards = \[.*\]: should be None or a dict"),
        ({"rewards": {"delivry": 1.0}}, SetupError, "'delivry'; did you mean 'delivery'"),
        ({"rewards": {"delivery": np.nan}}, SetupError, r"rewards\['delivery'\] = nan"),
    ],
)
def test_wrong_arguments_are_refused(
    arguments: dict[str, Any], error: type[Exception], complaint: str
) -> None:
    with pytest.raises(error, match=complaint):
        parallel_env(**arguments)


def test_nothing_is_rendered_without_a_render_mode() -> None:
    env = parallel_env(n_robots=2)
    env.reset(seed=0)
    with pytest.raises(SetupError, match='render_mode = None: should be "rgb_array" or "human"'):
        env.render()


def test_episodes_follow_from_the_last_seed_that_was_given_and_differ() -> None:
    def bits(env: SwarmLogisticsEnv, seed: int | None) -> bytes:
        return env.reset_arrays(seed).tobytes() + env.step_arrays(np.ones((3, 4)))[0].tobytes()

    env, other, unseeded = (parallel_env(n_robots=3) for _ in range(3))
    seen = [bits(env, seed) for seed in (0, None, None)]
    assert [bits(other, seed) for seed in (0, None, None)] == seen
    assert bits(env, 0) == seen[0]
    seen += [bits(unseeded, None), bits(unseeded, None), bits(parallel_env(n_robots=3), None)]
    assert len(set(seen)) == 6


def test_spaces_and_possible_agents_stay_as_they_were_made() -> None:
    env = parallel_env(n_robots=3, n_items=5, max_robots=4)
    agents, spaces, state_space = env.possible_agents, env.observation_spaces, env.state_space
    assert list(spaces) == list(env.action_spaces) == agents
    env.reset(seed=0)
    before = env.warehouse.state
    for scenario, complaint in (
        ({"n_robots": 5}, "n_robots = 5: should be at most 4"),
        ({"n_items": 6}, "n_items = 6: observations or states could leave their spaces"),
        ({"message_size": 1}, "message_size = 1: observations or states"),
    ):
        with pytest.raises(SetupError, match=complaint):
            env.reset(seed=1, options={"scenario": scenario})
        assert env.warehouse.state is before
    with pytest.raises(ScenarioError, match="n_robot"):
        env.reset(seed=1, options={"scenario": {"n_robot": 3}})
    for n_robots in (1, 4):
        env.reset(seed=1, options={"scenario": {"n_robots": n_robots, "n_items": 2}})
        assert len(env.agents) == n_robots
        assert state_space.contains(env.state())
    assert env.possible_agents == agents
    assert env.observation_spaces == spaces
    assert env.state_space == state_space


def test_a_reset_that_leaves_nobody_is_refused() -> None:
    env = parallel_env(n_robots=3, faults=[Fault("removed", 2), Fault("removed", (0, 1, 2), 0.1)])
    with pytest.raises(SetupError, match="remove all 2 robots at 0 s"):
        env.reset(seed=0, options={"scenario": {"n_robots": 2}, "faults": [Fault("removed", 2)]})
    assert not env.is_begun
    assert len(env.reset(seed=0)[0]) == 1


@pytest.mark.parametrize(
    ("arguments", "is_cut", "steps"),
    [
        ({"max_cycles": 7}, True, 7),
        ({"duration": 0.5, "max_cycles": 7}, True, 5),
        ({"scenario": REACHABLE}, False, None),
        ({"scenario": REACHABLE, "restock": True, "duration": 20.0}, True, 200),
        ({"faults": [Fault("removed", (0, 1), onset=0.1)]}, False, 1),
    ],
)
def test_all_end_together_and_a_step_after_that_is_refused_and_moves_nothing(
    arguments: dict[str, Any], is_cut: bool, steps: int | None
) -> None:
    env = parallel_env(**{"n_robots": 2, **arguments})
    with pytest.raises(SetupError, match="step before reset: call reset"):
        env.step({})
    for _ in range(2):
        env.reset(seed=0)
        total, step = 0.0, 0
        while env.agents:
            _, rewards, terminated, truncated, infos = env.step(east(env))
            step += 1
            total += rewards["robot_0"]
            assert set(terminated.values()) == {not env.agents and not is_cut}
            assert set(truncated.values()) == {not env.agents and is_cut}
        assert steps in (None, step)
        assert total == infos["robot_1"]["delivered"]
        assert (total > 0.0) == ("scenario" in arguments)
        with pytest.raises(SetupError, match="step after the end of the episode: call reset"):
            env.step({})
        assert env.warehouse.state.step == step
        assert env.state_space.contains(env.state())
        env.max_cycles = step  # once more, so that what ends them comes as the time ends


def test_unknown_options_are_ignored_with_a_warning_unless_a_known_one_is_nearly_meant() -> None:
    env = parallel_env(n_robots=2)
    with pytest.warns(UserWarning, match="reset option 'default' is ignored"):
        assert len(env.reset(seed=0, options={"default": [Fault("removed", 1)]})[0]) == 2
    for name in ("fault", "FAULTS", "senario", "n_robots"):
        for each in (env, FaultInjection(env, "FM1")):
            with pytest.raises(SetupError, match=f"no reset option '{name}': should be 'faults'"):
                each.reset(seed=0, options={name: ()})


def test_a_removed_robot_terminates_once_and_leaves() -> None:
    faults = [Fault("removed", (1,), onset=0.2), Fault("removed", (3,))]
    env = parallel_env(n_robots=4, faults=faults)
    observations, _ = env.reset(seed=0)
    assert list(observations) == ["robot_0", "robot_1", "robot_2"]
    assert env.possible_agents == [*observations, "robot_3"]
    _, _, terminated, truncated, _ = env.step(still(env))
    assert not any(terminated.values())
    observations, rewards, terminated, truncated, infos = env.step(still(env))
    assert terminated == {"robot_0": False, "robot_1": True, "robot_2": False}
    assert not any(truncated.values())
    for part in (observations, rewards, infos):
        assert list(part) == ["robot_0", "robot_1", "robot_2"]
    assert env.agents == ["robot_0", "robot_2"]
    env.step(still(env))
    observations, *_ = env.step({**still(env), "robot_1": np.zeros(4)})
    assert list(observations) == ["robot_0", "robot_2"]


def test_a_robot_that_is_away_stays_an_agent_in_dicts_and_arrays_alike() -> None:
    faults = [Fault("away", (1,), onset=0.2, duration=0.3), Fault("away", (0,), 0.1, 9.0)]
    env, rows = (parallel_env(REACHABLE, faults=faults, duration=1.0) for _ in range(2))
    env.reset(seed=0)
    rows.reset_arrays(seed=0)
    away = []
    while env.agents:
        observations, paid, terminated, truncated, infos = env.step(still(env))
        arrays = rows.step_arrays(np.zeros((2, 4)))
        for robot, agent in enumerate(("robot_0", "robot_1")):
            np.testing.assert_array_equal(observations[agent], arrays[0][robot])
            parts = [paid[agent], terminated[agent], truncated[agent]]
            assert parts == [part[robot] for part in arrays[1:]]
            assert observations[agent].any() != bool(infos[agent]["away"])
        away.append([info["away"] for info in infos.values()])
        assert not any(terminated.values())
        assert all(truncated.values()) == (len(away) == 10)
    assert away == [[1, 0], *[[1, 1]] * 3, *[[1, 0]] * 6]


def test_a_robot_that_is_away_earns_nothing_and_ends_if_it_is_removed_meanwhile() -> None:
    faults = [Fault("away", (1,), onset=0.1, duration=9.0), Fault("removed", (1,), onset=0.3)]
    env = parallel_env(REACHABLE, n_items=2, faults=faults)
    env.reset(seed=0)
    env.step(east(env))
    for is_over in (False, True):
        _, paid, terminated, _, infos = env.step(east(env))
        assert (paid["robot_1"], terminated["robot_1"]) == (0.0, is_over)
        assert infos["robot_1"]["away"] == int(not is_over)
    assert env.agents == ["robot_0"]


def test_infos_tell_failures_while_they_hold_and_observations_do_not() -> None:
    faults = [Fault("FM2", (1,), onset=0.2, duration=0.2), Fault("FM4", (1,), onset=0.3)]
    failing, healthy = parallel_env(n_robots=2, faults=faults), parallel_env(n_robots=2)
    assert data_equivalence(failing.reset(seed=0)[0], healthy.reset(seed=0)[0])
    modes = []
    for _ in range(5):
        seen, _, _, _, infos = failing.step(still(failing))
        assert data_equivalence(seen, healthy.step(still(healthy))[0])
        modes.append(failing.warehouse.state.failure_modes[1])
        assert infos["robot_0"] == {"failed": 0, "away": 0, "delivered": 0}
        assert infos["robot_1"] == {"failed": int(bool(modes[-1])), "away": 0, "delivered": 0}
    assert modes == [(), ("FM2",), ("FM2", "FM4"), ("FM4",), ("FM4",)]


def test_an_absent_robot_earns_nothing() -> None:
    env = parallel_env(REACHABLE, faults=[Fault("removed", (1,))])
    env.reset(seed=0)
    ended, total = np.zeros(2, np.bool_), np.zeros(2)
    while not ended.any():
        _, paid, ended, _ = env.step_arrays([east(env)["robot_0"], np.zeros(4)])
        total += paid
    assert total.tolist() == [1.0, 0.0]
    assert ended.tolist() == [True, False]


def test_the_state_of_a_robot_that_is_shoved_lies_in_its_space() -> None:
    env = SwarmLogisticsEnv(n_robots=2)
    env.reset(seed=0)
    env.warehouse.state.robot_velocity[:] = [[9.0, -9.0], [0.0, 9.0]]
    assert env.state_space.contains(env.state())


def test_the_state_tells_nothing_of_robots_that_are_gone_nor_of_items_that_were_delivered() -> None:
    gone = [Fault("removed", (0,)), Fault("removed", (2,), onset=0.2)]
    env = parallel_env(REACHABLE, n_robots=3, n_items=2, faults=gone)
    env.reset(seed=0)

    def told() -> tuple[NDArray[Any], NDArray[Any]]:
        state = env.state()
        return state[:33].reshape(3, 11), state[33:43].reshape(2, 5)

    assert told()[0][:, 0].tolist() == [0.0, 1.0, 1.0]
    delivered = env.warehouse.state.requested
    while not env.warehouse.state.delivered:
        env.step(east(env))
    robots, items = told()
    assert robots[:, 0].tolist() == [0.0, 1.0, 0.0]
    assert not robots[[0, 2]].any()
    assert not items[delivered].any()
    assert items[1 - delivered, 2:4].all()


def test_a_robot_that_is_removed_between_two_steps_terminates_in_the_next() -> None:
    env = parallel_env(n_robots=3)
    env.reset(seed=0)
    env.step(still(env))
    env.warehouse.set_faults([Fault("removed", (1,))])
    _, _, terminated, _, _ = env.step(still(env))
    assert terminated == {"robot_0": False, "robot_1": True, "robot_2": False}
    assert env.agents == ["robot_0", "robot_2"]
