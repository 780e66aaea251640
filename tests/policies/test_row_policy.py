"""One robot that a policy steers is its row in a swarm: with numba, and without."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies import NAMES, files, load
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.policies.row_policy import Robot, RowPolicy
from swarm_logistics_env.robots.c_export import write_c
from swarm_logistics_env.robots.contract import contract_of
from swarm_logistics_env.world import observations
from verification import trajectories

ROW_POLICIES = ["homing", "homing-stock", "site-fidelity", "swarm-dt", "biased-walk", "ppo-robust"]
SMALL: dict[str, Any] = {
    "n_robots": 6, "n_items": 10, "warehouse_width": 4.0, "warehouse_height": 3.0,
    "delivery_width": 1.0, "restock": True,
}  # fmt: skip
WHEELS = Scenario(**SMALL, drive="differential", handling_time=0.3, message_size=2)


class Alone:
    """A swarm of robots that are steered one by one."""

    def __init__(self, policy: Any) -> None:
        self._policy = policy

    def configure(self, scenario: Scenario) -> None:
        self._scenario = scenario

    def reset(self, n_robots: int, seed: int) -> None:
        period = self._scenario.control_period
        numbers = range(n_robots)
        self.robots = [self._policy.robot(self._scenario, period, seed, i) for i in numbers]

    def act(self, rows: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.array([robot.step(row) for robot, row in zip(self.robots, rows, strict=True)])


GOLDEN = {
    name: golden
    for name, golden in trajectories.GOLDEN.items()
    if not getattr(load(golden.policy), "needs_state", False)
}
GOLDEN |= {
    f"{name} with wheels": trajectories.GoldenTrajectory(WHEELS, policy=name, seed=1)
    for name in ROW_POLICIES
}
# Each robot reads its own body, in the swarm as alone.
KINDS = Scenario(**SMALL).replace(
    robot_kinds="plain:2 max_speed=1.0, wheels:1 drive=differential, scout:1 lifts=false"
)
GOLDEN |= {
    f"{name} of kinds": trajectories.GoldenTrajectory(KINDS, policy=name, seed=1)
    for name in ROW_POLICIES
}
IN_GATE = {
    "homing-stock that lifts slowly", "ppo-robust", "other periods", "homing with wheels",
    "ppo-robust with wheels", "site-fidelity with wheels", "swarm-dt of kinds",
    "biased-walk of kinds",
}  # fmt: skip


@pytest.mark.unmeasured
@pytest.mark.compiled
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in IN_GATE else pytest.mark.daily) for name in GOLDEN],
)
def test_robots_one_by_one_are_the_swarm_to_the_bit(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    as_swarm = trajectories.digests(GOLDEN[name])
    monkeypatch.setattr(policies, "load", lambda policy: Alone(load(policy)))
    assert trajectories.digests(GOLDEN[name]) == as_swarm


@pytest.mark.parametrize("name", ["central", "central-stock", "homing-told", "biased-walk-compass"])
def test_what_sees_the_whole_warehouse_steers_no_robot(name: str) -> None:
    policy: Any = load(name)
    with pytest.raises(PolicyError, match="sees the state of the whole warehouse"):
        policy.robot(Scenario(), 0.1, seed=0)


def test_a_policy_of_which_nobody_knows_what_robots_share_steers_none() -> None:
    with pytest.raises(PolicyError, match="policy = Alone: should be a script or a trained policy"):
        Robot(Alone(load("homing")), Scenario(), 0.1, seed=0)
    network: Any = policies.of(lambda rows: np.zeros((len(rows), 4)))
    with pytest.raises(PolicyError, match="should be a script or a trained policy"):
        network.robot(Scenario(), 0.1, seed=0)


def test_all_shipped_policies_that_decide_from_rows_steer_robots() -> None:
    for name in NAMES:
        policy = load(name)
        assert isinstance(policy, RowPolicy) or getattr(policy, "needs_state", False)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (np.zeros(140), r"row of shape \(140,\): should be \(141,\)"),
        (np.zeros((1, 141)), r"row of shape \(1, 141\): should be \(141,\)"),
        (np.where(np.arange(141) == 17, np.nan, 0.0), r"row\[17\] = nan: should be finite"),
        (["x"] * 141, "row: should be numbers"),
    ],
)
def test_a_row_that_cannot_be_is_refused_and_not_remembered(row: Any, words: str) -> None:
    robot = Robot(load("homing"), Scenario(), 0.1, seed=0)
    robot.step(np.zeros(141))
    memory = robot.memory
    with pytest.raises(PolicyError, match=words):
        robot.step(row)
    assert robot.memory == memory


def test_a_robot_has_the_body_of_its_kind() -> None:
    robots = [Robot(load("homing"), KINDS, 0.1, seed=0, number=number) for number in range(4)]
    speeds = [robot.memory["top_speed"] for robot in robots]
    assert speeds == [KINDS.of_robot(number).max_speed for number in range(4)]
    assert sorted(speeds) == [1.0, 1.0, 2.0, 2.0]
    for of_one_body in (contract_of, functools.partial(write_c, path="none.c")):
        with pytest.raises(PolicyError, match=r"= plain, wheels, scout: .* one body"):
            of_one_body(load("homing"), KINDS)


def test_its_period_is_that_of_its_loop() -> None:
    body = Scenario(drive="differential")
    robot = Robot(load("homing"), body, 0.05, seed=0)
    assert robot.body.control_period == 0.05
    assert robot.memory["widest_turn"] == pytest.approx(0.05 * body.max_turn_rate)
    # Of physics it has as many steps as a scenario wants, and one or more.
    for period, n_substeps in ((0.05, 3), (0.04, 2), (0.01, 1)):
        robot = Robot(load("homing"), body, period, seed=0)
        assert robot.body.physics_period == pytest.approx(period / n_substeps)
    assert Robot(load("homing"), body, 0.1, seed=0).body == body
    with pytest.raises(PolicyError, match="number = -1: should be 0 or more"):
        Robot(load("homing"), body, 0.1, seed=0, number=-1)


def rows_of_run(policy: Any, scenario: Scenario, steps: int) -> NDArray[np.float32]:
    """Return the rows (T, N, D) that a swarm of `policy` reads."""
    world = Warehouse(scenario)
    rows = world.reset(3)
    start(policy, scenario, 3)
    read = []
    for _ in range(steps):
        read.append(rows.copy())
        rows = world.step(policy.act(rows))
    return np.array(read)


@pytest.mark.compiled
@pytest.mark.parametrize("name", ROW_POLICIES)
def test_columns_that_it_ignores_never_change_a_command(name: str) -> None:
    policy: Any = load(name)
    rows = rows_of_run(policy, WHEELS, 200)
    start(policy, WHEELS, 3)
    commands = [policy.act(observed) for observed in rows]
    rng = np.random.default_rng(0)
    for column in observations.columns(WHEELS):
        if column.name in policy.ignores:
            part = rows[..., column.columns]
            part[...] = rng.uniform(column.low, column.high, part.shape)
    start(policy, WHEELS, 3)
    np.testing.assert_array_equal([policy.act(observed) for observed in rows], commands)


WITHOUT_NUMBA = """
import sys
import warnings

sys.modules["numba"] = None
warnings.simplefilter("error")
import numpy as np

from tests.policies import test_row_policy as given
from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import SetupError

recorded = np.load(sys.argv[1])
commands = {}
for name, rows in recorded.items():
    robot = policies.load(name).robot(given.WHEELS, 0.1, 3, 2)
    commands[name] = [robot.step(row) for row in rows]
np.savez(sys.argv[2], **commands)
try:
    given.Warehouse(given.WHEELS)
except SetupError as error:
    print(error)
"""


@pytest.mark.unmeasured
@pytest.mark.compiled
def test_without_numba_a_robot_does_the_same(tmp_path: Path) -> None:
    rows = {name: rows_of_run(load(name), WHEELS, 500)[:, 2] for name in ROW_POLICIES}
    np.savez(tmp_path / "rows.npz", allow_pickle=False, **rows)
    paths = [str(tmp_path / name) for name in ("rows.npz", "out.npz")]
    command = [sys.executable, "-c", WITHOUT_NUMBA, *paths]
    root = Path(files.__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "numba is missing: a world needs it" in done.stdout
    with np.load(tmp_path / "out.npz") as commands:
        for name in ROW_POLICIES:
            robot = Robot(load(name), WHEELS, 0.1, 3, 2)
            np.testing.assert_allclose(
                commands[name], [robot.step(row) for row in rows[name]], rtol=0, atol=1e-6
            )
