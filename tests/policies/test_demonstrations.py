"""What demonstrations hold, and that their actions ask for what the policy did."""

from __future__ import annotations

import doctest
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.policies import demonstrations
from swarm_logistics_env.policies.demonstrations import record
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.wrappers import MotionFrame
from tests.made_up import CAREFUL

SMALL = Scenario(n_robots=4, n_items=8, warehouse_width=6.0, warehouse_height=5.0, duration=20.0)
FAULTS = ["removed:1@5", "FM1:1@3"]
# Where robots touch, the float32 of what is recorded makes another run of it.
HOMING = Homing(**CAREFUL)


def test_they_hold_every_decision_of_every_robot_that_is_there() -> None:
    recorded = record(HOMING, 2, scenario=SMALL, seed=3, faults=FAULTS)
    episodes = [run_episode(SMALL, HOMING, 3 + k, FAULTS) for k in range(2)]
    assert recorded.delivered == [episode.delivered for episode in episodes]
    lengths = sorted(len(robot.actions) for robot in recorded.episodes if robot.seed == 3)
    assert lengths == [50, 200, 200, 200]
    for robot in recorded.episodes:
        n_steps = len(robot.actions)
        assert robot.terminated == (n_steps == 50)
        assert robot.observations.shape == (n_steps + 1, 141)
        assert robot.actions.shape == (n_steps, 4)
        assert recorded.observation_space.contains(robot.observations[0])
    # The robot that fails first also leaves first, 2 s later.
    assert sum(robot.failed.sum() for robot in recorded.episodes if robot.seed == 3) == 20
    rewards = max(robot.rewards.sum() for robot in recorded.episodes if robot.seed == 3)
    assert rewards == episodes[0].delivered


@pytest.mark.parametrize(
    "fields",
    [{"drive": "holonomic"}, {"drive": "differential"}, {"robot_kinds": "a drive=differential, b"}],
)
def test_outputs_in_the_frame_ask_for_the_motion_of_the_policy(fields: Any) -> None:
    scenario = SMALL.replace(**fields)
    recorded = record(HOMING, 1, scenario=scenario, frame=True)
    # Played again from the outputs, the world goes the same way.
    env = MotionFrame(SwarmLogisticsEnv(scenario))
    first = env.reset_arrays(0)
    actions = np.stack([robot.actions for robot in recorded.episodes], axis=1)
    rows = np.stack([first, *(env.step_arrays(step)[0] for step in actions)])
    seen = np.stack([robot.observations for robot in recorded.episodes], axis=1)
    np.testing.assert_array_equal(rows, seen)
    # And as far as the policy itself would have gone.
    episodes = [run_episode(scenario, HOMING, seed) for seed in range(3)]
    delivered = [episode.delivered for episode in episodes]
    recorded = record(HOMING, 3, scenario=scenario, frame=True)
    assert recorded.delivered == delivered


def test_files_hold_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    arguments = ["record", "--policy", "homing", "--policy", "swarm-dt", "--episodes", "1"]
    options = ["--frame", "--out", str(tmp_path), "--set", "n_robots=3", "--set", "duration=2"]
    assert app.run([*arguments, *options]) == 0
    assert "swarm-dt.parquet: Demonstrations(" in capsys.readouterr().out
    table = parquet.read_table(tmp_path / "homing.parquet")
    (robot, *_) = record(
        "homing", 1, scenario=Scenario(n_robots=3, duration=2.0), frame=True
    ).episodes
    frame = table.to_pandas().query("robot == 0")
    np.testing.assert_array_equal(np.stack(frame["observation"]), robot.observations[:-1])
    np.testing.assert_array_equal(np.stack(frame["action"]), robot.actions)
    assert frame["truncated"].tolist() == [False] * 19 + [True]
    assert b"scenario" in table.schema.metadata
    # A checksum tells of a page in which a number is damaged.
    content = bytearray((tmp_path / "homing.parquet").read_bytes())
    content[content.index(np.float32(robot.observations[0, 0]).tobytes())] ^= 1
    (tmp_path / "homing.parquet").write_bytes(content)
    with pytest.raises(OSError, match="CRC checksum verification failed"):
        parquet.read_table(tmp_path / "homing.parquet", page_checksum_verification=True)


def test_imitation_learning_takes_the_transitions() -> None:
    recorded = record("homing", 1, scenario=SMALL, faults=["removed:1@5"])
    observations, actions, following, ends = recorded.transitions()
    assert len(observations) == len(actions) == len(following) == len(ends) == 650
    assert ends.sum() == 1
    np.testing.assert_array_equal(observations[1], following[0])


def test_a_robot_that_is_never_there_has_no_episode() -> None:
    recorded = record(HOMING, 1, scenario=SMALL.replace(duration=1.0), faults=["removed:1@0"])
    assert [robot.robot for robot in recorded.episodes] == [1, 2, 3]


def test_a_policy_that_sees_more_than_rows_is_refused() -> None:
    with pytest.raises(SetupError, match="policy 'central' has needs_state: should decide by"):
        record("central")
    with pytest.raises(SetupError, match="episodes = 0"):
        record("homing", 0)


def test_the_example_of_its_docstring_runs() -> None:
    assert doctest.testmod(demonstrations).failed == 0
