"""Policies of any network: torch, ONNX, a function; what identifies them, and what is refused."""

from __future__ import annotations

import copy
import doctest
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box

from swarm_logistics_env import Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.policies import models
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.world.motion.network_inputs import LEAD
from swarm_logistics_env.world.observations import N_COLUMNS, N_NEIGHBOURS
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize, Wrapper

BRIEF = Scenario(n_robots=3, n_items=10, duration=2.0)
WEIGHTS = np.random.default_rng(0).normal(0.0, 0.3, (95, 3)).astype(np.float32)


def linear(rows: Any) -> Any:
    return np.tanh(rows @ WEIGHTS)


def test_a_trained_network_plays_as_its_policy_file_does() -> None:
    """Without noise, and deciding each step, both are the same network in the same frame."""
    learned: Any = policies.load("ppo-delivery")
    card = learned.card.replace(
        network=learned.card.network.replace(exploration=0.0, decides_every=1)
    )
    steady: Any = type(learned)(card, learned.tensors)
    policy = policies.of(steady.outputs_of, frame=True)
    rows = np.random.default_rng(0).normal(size=(40, 5, N_COLUMNS)).astype(np.float32)
    policy.reset(5, 3)
    steady.reset(5, 3)
    steady._frame.begin_rows(np.arange(5), policy._view.keys)
    for step in rows:
        np.testing.assert_array_equal(policy.act(step), steady.act(step))


def test_torch_onnx_and_a_function_of_one_network_give_the_same_commands() -> None:
    torch = pytest.importorskip("torch")
    layer = torch.nn.Linear(95, 3, bias=False)
    layer.weight.data = torch.from_numpy(WEIGHTS.T.copy())
    module = torch.nn.Sequential(layer, torch.nn.Tanh())

    def with_gradient(rows: Any) -> Any:
        return module(torch.as_tensor(rows))

    class Session:  # as onnxruntime's
        def get_inputs(self) -> Any:
            return [type("Input", (), {"name": "inputs"})]

        def run(self, _: None, rows: dict[str, Any]) -> Any:
            return [linear(rows["inputs"])]

    rows = np.random.default_rng(1).normal(size=(4, N_COLUMNS)).astype(np.float32)
    commands = []
    for network in (linear, module, with_gradient, Session()):
        policy = policies.of(network, frame=True)
        policy.reset(4, 0)
        commands.append(policy.act(rows))
    for other in commands[1:]:
        np.testing.assert_allclose(other, commands[0], atol=1e-6)


def test_whole_numbers_are_discrete_actions() -> None:
    def numbers(rows: Any) -> Any:
        return np.arange(len(rows)) + 10

    policy = policies.of(numbers)
    policy.reset(3, 0)
    commands = policy.act(np.zeros((3, N_COLUMNS), np.float32))
    assert commands.tolist() == [[0, 0, -1, 0], [0, 0, 0, 1], [0, 0, 0, -1]]
    policy.reset(4, 0)
    with pytest.raises(PolicyError, match="should be 0 to 12, as those of DiscreteActions"):
        policy.act(np.zeros((4, N_COLUMNS), np.float32))


def test_a_model_is_known_by_its_numbers_and_its_form_and_each_run_has_a_memory() -> None:
    torch = pytest.importorskip("torch")
    module = torch.nn.Linear(95, 3)
    policy: Any = policies.of(module, frame=True)
    identity = policies.identity(policy)
    assert policies.identity(policies.of(copy.deepcopy(module), frame=True)) == identity
    assert policies.identity(policies.of(module, frame=True, listens=False)) != identity
    with torch.no_grad():
        module.bias += 1.0
    assert policies.identity(policies.of(module, frame=True)) != identity
    first = PolicySpec.of(policy).load()
    again = PolicySpec.of(pickle.loads(pickle.dumps(policy))).load()
    run_episode(BRIEF, first, seed=0)
    assert run_episode(BRIEF, first, seed=1).digest == run_episode(BRIEF, again, seed=1).digest


class Counting:
    """A model that notes how often it was asked, and answers by it."""

    n_calls = 0

    def __call__(self, rows: Any) -> Any:
        self.n_calls += 1
        return np.full((len(rows), 3), 0.1 * self.n_calls)


def test_two_runs_at_once_share_no_model() -> None:
    policy = policies.of(Counting(), frame=True)
    run, twin = PolicySpec.of(policy).load(), PolicySpec.of(policy).load()
    rows = np.zeros((4, N_COLUMNS), np.float32)
    for player in (run, twin):
        player.reset(4, 0)
    first = run.act(rows)
    assert not np.array_equal(run.act(rows), first)
    np.testing.assert_array_equal(twin.act(rows), first)


def test_two_runs_at_once_share_no_memory() -> None:
    policy = policies.of(linear, frame=True)
    run, twin = PolicySpec.of(policy).load(), PolicySpec.of(policy).load()
    rows = np.random.default_rng(0).normal(size=(2, 4, N_COLUMNS)).astype(np.float32)
    for player in (policy, run, twin):
        player.reset(4, 0)
    run.act(rows[0])
    np.testing.assert_array_equal(twin.act(rows[1]), policy.act(rows[1]))


def test_a_network_that_listens_to_nobody_reads_zeros_there() -> None:
    inputs: dict[bool, Any] = {}
    rows = np.random.default_rng(0).normal(size=(40, 5, N_COLUMNS)).astype(np.float32)
    for listens in (True, False):

        def network(read: Any, listens: bool = listens) -> Any:
            inputs[listens] = read
            return linear(read)

        policy = policies.of(network, frame=True, listens=listens)
        policy.reset(5, 0)
        for step in rows:
            policy.act(step)
    assert inputs[True][:, LEAD].any()
    assert not inputs[False][:, LEAD].any()


@pytest.mark.parametrize(
    ("network", "options", "message"),
    [
        (linear, {}, "failed with rows of shape .*; if it learned through MotionFrame: frame=True"),
        (lambda rows: rows[:, :2], {"frame": True}, r"shape \(3, 2\): should be \(3, 3\), along"),
        (lambda rows: rows[:, :3], {}, r"shape \(3, 3\): should be \(3, 4\), commands"),
        (None, {}, "network = None: should be a function of rows, a torch module"),
        (dict, {}, "network = <class 'dict'>: should be a function of rows"),
        (lambda rows: rows[:, :13], {}, "should be .*, as argmax makes of 13 values"),
        (linear, {"normalize": 3.0}, "normalize = 3.0: should be None, a function of rows, a pair"),
    ],
)
def test_what_is_no_model_is_refused(network: Any, options: Any, message: str) -> None:
    with pytest.raises(PolicyError, match=message):
        run_episode(BRIEF, policies.of(network, **options), seed=0)


class Beacon(Wrapper):
    """Adds to each row how far the robot is from the western wall [m]."""

    def observation_space(self, agent: str) -> Box:
        inner = self.env.observation_space(agent)
        return Box(np.append(inner.low, 0.0), np.append(inner.high, 20.0), dtype=np.float32)

    def reset_arrays(self, seed: Any = None, options: Any = None) -> Any:
        return self._added(super().reset_arrays(seed, options))

    def after_step(self, outcome: Any) -> Any:
        return (self._added(outcome[0]), *outcome[1:])

    def _added(self, rows: Any) -> Any:
        x = self.warehouse.state.robot_position[:, :1]
        return np.hstack([rows, x.astype(np.float32)])


class Eastward:
    """Drives until it is 3 m from the western wall."""

    def configure(self, scenario: Scenario) -> None:
        self.scenario = scenario

    def reset(self, n_robots: int, seed: int) -> None:
        pass

    def act(self, rows: Any) -> Any:
        return np.stack([rows[:, -1] < 3.0, *np.zeros((3, len(rows)))], axis=1)


def test_a_policy_within_wrappers_knows_the_scenario() -> None:
    driver = Eastward()
    policies.within(driver, Beacon).configure(BRIEF)
    assert driver.scenario == BRIEF


@pytest.mark.daily
def test_a_policy_with_a_sensor_of_its_own_is_judged_as_any_other(tmp_path: Path) -> None:
    driver = Eastward()
    policy = policies.within(driver, Beacon)
    episode = run_episode(BRIEF, policy, seed=0, faults=["removed:1@1"])
    assert driver.scenario == BRIEF
    assert episode.failed_robots
    assert run_episode(BRIEF, policy, seed=0, faults=["removed:1@1"]).digest == episode.digest
    # A film and the live view play it, too; a fault may come while it plays.
    play = Play(BRIEF, policy, seed=0)
    for _ in range(5):
        play.step()
    play.world.set_faults(["dead:3"])
    while not play.is_over:
        play.step()
    assert play.world.state.step == 20
    file = tmp_path / "mine.py"
    file.write_text(
        "import sys\nsys.path.insert(0, '.')\n"
        "from tests.policies.test_models import Beacon, Eastward\n"
        "def wrap(env):\n    return Beacon(env)\n"
    )
    named = {"name": f"{file}:Eastward", "parameters": {"env": f"{file}:wrap"}}
    study = Study(
        out=tmp_path / "out", policies=[named], seeds=3, sizes=[{"values": [2, 3]}],
        scenario={"duration": 2.0, "n_items": 10},
    )  # fmt: skip
    assert not study.run(processes=2).failed
    assert app.run(["run", "--policy", f"{file}:Eastward", "--env", f"{file}:wrap",
                    "--set", "duration=1"]) == 0  # fmt: skip
    spec = PolicySpec.of(named)
    assert spec.runs_code
    identity = spec.identity()
    file.write_text(file.read_text() + "\nSPEED = 2\n")
    assert spec.identity() != identity


@pytest.mark.parametrize(
    ("wrap", "message"),
    [
        (lambda env: SwarmSize(FaultInjection(env, "FM1"), 3), "wrap changed the conditions"),
        (lambda env: None, "wrap made None of the environment: should be wrappers around it"),
        (lambda env: SwarmLogisticsEnv(n_robots=3), "should be wrappers around it"),
    ],
)
def test_wrappers_leave_conditions_to_the_study(wrap: Any, message: str) -> None:
    with pytest.raises(PolicyError, match=message):
        run_episode(BRIEF, policies.within(Eastward(), wrap), seed=0)


def test_what_cannot_be_within_is_refused() -> None:
    with pytest.raises(PolicyError, match="wrap = 3: should be a function of an environment"):
        policies.within(Eastward(), 3)  # type: ignore[arg-type]
    with pytest.raises(PolicyError, match="normalize: is for a network"):
        policies.within(Eastward(), Beacon, normalize=(0.0, 1.0))
    with pytest.raises(PolicyError, match=r"env 'homing': should be 'my.py:NAME'"):
        policies.load("homing", env="homing")


def test_a_class_where_an_object_belongs_is_told_so() -> None:
    with pytest.raises(PolicyError, match=r"the class SwarmDT: should be an object, as S"):
        run_episode(BRIEF, policies.SwarmDT, seed=0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"is the class SwarmDT: should be an object"):
        PolicySpec.of(policies.SwarmDT)


def test_a_policy_says_what_it_is() -> None:
    assert repr(policies.SwarmDT(taxis_gain=0.5)) == "SwarmDT(taxis_gain=0.5)"
    policy: Any = policies.load("homing")
    assert policy._repr_html_().startswith("<b>Homing()</b><br>Every robot remembers")
    assert repr(policies.of(linear, frame=True)) == "policies.of(function, frame=True)"


def test_the_example_of_its_docstring_runs() -> None:
    assert doctest.testmod(models).failed == 0


def test_a_model_that_reads_messages_may_send_some() -> None:
    def network(rows: Any) -> Any:
        if rows.shape[1] != N_COLUMNS + 2 * N_NEIGHBOURS:
            raise ValueError("no messages")
        return np.tile([0.0, 0.0, 0.0, 0.0, 0.25, -0.5], (len(rows), 1))

    world = Warehouse(Scenario(n_robots=3, n_items=2, message_size=2))
    policy = policies.of(network)
    rows = world.reset(0)
    policy.reset(3, 0)
    world.step(policy.act(rows))
    assert world.state.robot_message.tolist() == [[0.25, -0.5]] * 3
