"""What demonstrations hold, and that their actions ask for what the policy did."""

from __future__ import annotations

import doctest
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.policies import demonstrations
from swarm_logistics_env.policies.demonstrations import Demonstrations, record
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.wrappers import MotionFrame
from tests.made_up import CAREFUL

SMALL = Scenario(n_robots=4, n_items=8, warehouse_width=6.0, warehouse_height=5.0, duration=20.0)
FAULTS = ["removed:1@5", "FM1:1@3"]
# Where robots touch, the float32 of what is recorded makes another run of it.
HOMING = Homing(**CAREFUL)


def test_they_hold_every_decision_of_every_robot_that_is_there() -> None:
    demos = record(HOMING, 2, scenario=SMALL, seed=3, faults=FAULTS)
    episodes = [run_episode(SMALL, HOMING, 3 + k, FAULTS) for k in range(2)]
    assert demos.delivered == [episode.delivered for episode in episodes]
    lengths = sorted(len(robot.actions) for robot in demos.episodes if robot.seed == 3)
    assert lengths == [50, 200, 200, 200]
    for robot in demos.episodes:
        n_steps = len(robot.actions)
        assert robot.terminated == (n_steps == 50)
        assert robot.observations.shape == (n_steps + 1, 141)
        assert robot.actions.shape == (n_steps, 4)
        assert demos.observation_space.contains(robot.observations[0])
    # The robot that fails first also leaves first, 2 s later.
    assert sum(robot.failed.sum() for robot in demos.episodes if robot.seed == 3) == 20
    rewards = max(robot.rewards.sum() for robot in demos.episodes if robot.seed == 3)
    assert rewards == episodes[0].delivered
    assert [(robot.seed, robot.robot) for robot in demos.episodes[::3]] == [
        (3, 0),
        (3, 3),
        (4, 2),
    ]
    (leaver,) = (robot for robot in demos.episodes[:4] if robot.terminated)
    assert leaver.failed.nonzero()[0].tolist() == list(range(30, 50))
    counts = f"2 episodes, 8 robots, 1,300 decisions, P {sum(demos.delivered) / 2:.1f}"
    assert repr(demos) == f"Demonstrations({HOMING!r}: {counts})"
    empty = replace(demos, delivered=[], episodes=[])
    assert repr(empty).endswith(": 0 episodes, 0 robots, 0 decisions, P nan)")


@pytest.mark.parametrize(
    "fields",
    [{"drive": "holonomic"}, {"drive": "differential"}, {"robot_kinds": "a drive=differential, b"}],
)
def test_outputs_in_the_frame_ask_for_the_motion_of_the_policy(fields: Any) -> None:
    scenario = SMALL.replace(**fields)
    demos = record(HOMING, 1, scenario=scenario, frame=True)
    # Played again from the outputs, the world goes the same way.
    env = MotionFrame(SwarmLogisticsEnv(scenario))
    first = env.reset_arrays(0)
    actions = np.stack([robot.actions for robot in demos.episodes], axis=1)
    rows = np.stack([first, *(env.step_arrays(step)[0] for step in actions)])
    recorded_rows = np.stack([robot.observations for robot in demos.episodes], axis=1)
    np.testing.assert_array_equal(rows, recorded_rows)
    # And as far as the policy itself would have gone.
    episodes = [run_episode(scenario, HOMING, seed) for seed in range(3)]
    delivered = [episode.delivered for episode in episodes]
    demos = record(HOMING, 3, scenario=scenario, frame=True)
    assert demos.delivered == delivered


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
    assert table.schema.metadata[b"policy"] == b"Homing()"
    assert b'"n_robots":3' in table.schema.metadata[b"scenario"]
    # A checksum tells of a page in which a number is damaged.
    content = bytearray((tmp_path / "homing.parquet").read_bytes())
    content[content.index(np.float32(robot.observations[0, 0]).tobytes())] ^= 1
    (tmp_path / "homing.parquet").write_bytes(content)
    with pytest.raises(OSError, match="CRC checksum verification failed"):
        parquet.read_table(tmp_path / "homing.parquet", page_checksum_verification=True)


def recorded_with_a_leaver() -> Demonstrations:
    """Record an episode in which one robot leaves after 50 of 200 steps."""
    return record("homing", 1, scenario=SMALL, faults=["FM1:1@3", "removed:1@5"])


def test_imitation_learning_takes_the_transitions() -> None:
    demos = recorded_with_a_leaver()
    observations, actions, following, ends = demos.transitions()
    assert len(observations) == len(actions) == len(following) == len(ends) == 650
    robots = demos.episodes
    leaver = [len(robot.actions) for robot in robots].index(50)
    assert ends.nonzero()[0].tolist() == [200 * leaver + 49]
    for rows, steps in ((observations, slice(-1)), (following, slice(1, None))):
        np.testing.assert_array_equal(rows, np.vstack([r.observations[steps] for r in robots]))
    np.testing.assert_array_equal(actions, np.vstack([robot.actions for robot in robots]))


def test_a_parquet_file_has_a_row_for_each_decision(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    demos = recorded_with_a_leaver()
    demos.to_parquet(tmp_path / "rows.parquet")
    table = parquet.read_table(tmp_path / "rows.parquet").to_pydict()
    observations, actions, _, ends = demos.transitions()
    lengths = [len(robot.actions) for robot in demos.episodes]
    last = np.cumsum(lengths) - 1
    columns = {
        "seed": [0] * 650, "robot": np.repeat(range(4), lengths),
        "step": np.concatenate([np.arange(length) for length in lengths]),
        "observation": observations, "action": actions, "terminated": ends,
        "reward": np.concatenate([robot.rewards for robot in demos.episodes]),
        "failed": np.concatenate([robot.failed for robot in demos.episodes]),
        "truncated": np.isin(np.arange(650), np.delete(last, lengths.index(50))),
    }  # fmt: skip
    assert table.keys() == columns.keys()
    for name, values in columns.items():
        np.testing.assert_array_equal(table[name], values, name)


def test_a_robot_that_is_never_there_has_no_episode() -> None:
    demos = record(HOMING, 1, scenario=SMALL.replace(duration=1.0), faults=["removed:1@0"])
    assert [robot.robot for robot in demos.episodes] == [1, 2, 3]


def test_a_policy_that_sees_more_than_rows_is_refused() -> None:
    rest = (
        "should decide by the rows of the warehouse alone, as what it does is recorded beside these"
    )
    with pytest.raises(SetupError, match=f"^policy 'central' has needs_state: {rest}$"):
        record("central")
    wrapped: Any = Homing()
    wrapped.wrap = MotionFrame
    with pytest.raises(SetupError, match=rf"^policy Homing\(\) has wrap: {rest}$"):
        record(wrapped)
    with pytest.raises(SetupError, match="episodes = 0"):
        record("homing", 0)


def test_the_example_of_its_docstring_runs() -> None:
    assert doctest.testmod(demonstrations).failed == 0
