"""Demonstrations: what a policy read and did, for imitation and offline learning.

Each robot of each episode is a sequence of its own, as a policy decides for each robot alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import SetupError, how_to_install
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import checked_count
from swarm_logistics_env.policies.catalogue import load
from swarm_logistics_env.policies.policy import Policy, decide, one_thread, start
from swarm_logistics_env.policies.row_policy import refuse_messages
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.faults import FaultLike
from swarm_logistics_env.wrappers import MotionFrame

Rows = NDArray[np.float32]


class RobotEpisode(NamedTuple):
    """One robot in one episode, from its beginning until it left or time was up.

    Attributes:
        seed: of the episode.
        robot: its number.
        observations: (T + 1, D).
        actions: (T, k).
        rewards: (T,).
        failed: (T,) whether any failure mode held for it.
        terminated: whether it was removed or everything was delivered; else time was up.
    """

    seed: int
    robot: int
    observations: Rows
    actions: Rows
    rewards: NDArray[np.float64]
    failed: NDArray[np.bool_]
    terminated: bool


@dataclass(frozen=True)
class Demonstrations:
    """Episodes of a policy, robot by robot; `record` makes them.

    Attributes:
        policy: whose they are, in words.
        scenario: the conditions.
        is_framed: whether observations are rows of `motion.INPUTS` and actions `motion.OUTPUTS`.
        observation_space, action_space: of a robot.
        delivered: P of each episode.
        episodes: robot after robot, episode after episode.
    """

    policy: str
    scenario: Scenario
    is_framed: bool
    observation_space: Box
    action_space: Box
    delivered: list[int] = field(default_factory=list)
    episodes: list[RobotEpisode] = field(default_factory=list)

    def __repr__(self) -> str:
        n_steps = sum(len(episode.actions) for episode in self.episodes)
        mean = np.mean(self.delivered) if self.delivered else math.nan
        return (
            f"Demonstrations({self.policy}: {len(self.delivered)} episodes, "
            f"{len(self.episodes)} robots, {n_steps:,} decisions, P {mean:.1f})"
        )

    def transitions(self) -> tuple[Rows, Rows, Rows, NDArray[np.bool_]]:
        """Return observations (T, D), actions (T, k), next observations (T, D) and ends (T,).

        Of all robots one after another: what imitation learning and offline learners take.
        """
        observations = np.concatenate([e.observations[:-1] for e in self.episodes])
        following = np.concatenate([e.observations[1:] for e in self.episodes])
        actions = np.concatenate([e.actions for e in self.episodes])
        ends = np.zeros(len(actions), np.bool_)
        lengths = np.cumsum([len(e.actions) for e in self.episodes])
        ends[lengths[[e.terminated for e in self.episodes]] - 1] = True
        return observations, actions, following, ends

    def to_parquet(self, path: str | Path) -> None:
        """Write a row for each decision: seed, robot, step, observation, action, reward, failed.

        Each page has a checksum, so that pyarrow tells of a damaged file if it is read with
        `page_checksum_verification=True`.

        Raises:
            SetupError: pyarrow is missing, or the file cannot be written.
        """
        try:
            import pyarrow as pa
            from pyarrow import parquet
        except ModuleNotFoundError as error:
            raise SetupError(
                f"to write Parquet needs pyarrow ({error}): {how_to_install('tables')}"
            ) from error
        about = {"policy": self.policy, "scenario": self.scenario.model_dump_json()}
        with atomic_write(Path(path), SetupError) as part:
            writer = None
            for episode in self.episodes:
                n_steps = len(episode.actions)
                table = pa.table(
                    {
                        "seed": np.full(n_steps, episode.seed),
                        "robot": np.full(n_steps, episode.robot),
                        "step": np.arange(n_steps),
                        "observation": _lists(episode.observations[:-1]),
                        "action": _lists(episode.actions),
                        "reward": episode.rewards,
                        "failed": episode.failed,
                        "terminated": _ends(n_steps, episode.terminated),
                        "truncated": _ends(n_steps, not episode.terminated),
                    }
                ).replace_schema_metadata(about)
                writer = writer or parquet.ParquetWriter(
                    part, table.schema, write_page_checksum=True
                )
                writer.write_table(table)
            if writer is not None:
                writer.close()

    def to_minari(self, dataset_id: str, **about: Any) -> Any:
        """Return a Minari data set of these episodes, which is kept in Minari's own folder.

        Args:
            dataset_id: such as "swarm-logistics/homing-v0".
            **about: further arguments of `minari.create_dataset_from_buffers`, as `author`.

        Raises:
            SetupError: minari is missing.
            ValueError: Minari has such a data set already.
        """
        try:
            import minari
            from minari.data_collector import EpisodeBuffer
        except ModuleNotFoundError as error:
            raise SetupError(
                f"to write a Minari data set needs minari ({error}): {how_to_install('minari')}"
            ) from error
        buffers = [
            EpisodeBuffer(
                id=number,
                seed=episode.seed,
                observations=episode.observations,
                actions=episode.actions,
                rewards=episode.rewards.tolist(),
                terminations=_ends(len(episode.actions), episode.terminated).tolist(),
                truncations=_ends(len(episode.actions), not episode.terminated).tolist(),
                # A column, because Minari cannot read plain numbers of an info again.
                infos={"failed": np.append(episode.failed, episode.failed[-1])[:, None]},
            )
            for number, episode in enumerate(self.episodes)
        ]
        about = {
            "algorithm_name": self.policy,
            "data_format": "arrow",
            "description": f"{self!r} in {self.scenario.model_dump_json(exclude_defaults=True)}",
            **about,
        }
        return minari.create_dataset_from_buffers(
            dataset_id,
            buffers,
            observation_space=self.observation_space,
            action_space=self.action_space,
            **about,
        )


def record(
    policy: Policy | str,
    episodes: int = 10,
    *,
    scenario: Scenario | None = None,
    seed: int = 0,
    faults: Sequence[FaultLike] = (),
    frame: bool = False,
) -> Demonstrations:
    """Return what a policy read and did in episodes with the seeds `seed`, `seed` + 1, ...

    Rewards are 1 to each robot for each delivery of the swarm.

    Args:
        policy: its name, its path, or the object.
        episodes: how many; one of 500 s with 25 robots is 70 MB of memory.
        scenario: the conditions; None: the paper's.
        faults: of every episode, as `run_episode` takes them.
        frame: whether to record through `MotionFrame`, which is far easier to learn from: inputs,
            and outputs that ask for the same motion. The episodes are played by these outputs.

    Raises:
        SetupError: the number of episodes cannot be; the policy needs the state or an environment
            of its own, which a robot that imitates it would lack.
        ScenarioError, FaultError, PolicyError: as `run_episode`.

    Example:
        >>> demonstrations = record("homing", 1, scenario=Scenario(n_robots=2, duration=10.0))
        >>> observations, actions, following, ends = demonstrations.transitions()
        >>> observations.shape, actions.shape
        ((200, 141), (200, 4))
    """
    player = load(policy) if isinstance(policy, str) else policy
    scenario = scenario or Scenario()
    for name in ("needs_state", "wrap"):
        if getattr(player, name, None):
            raise SetupError(
                f"policy {policy!r} has {name}: should decide by the rows of the warehouse alone, "
                "as what it does is recorded beside these"
            )
    core = SwarmLogisticsEnv(scenario, faults=faults)
    if frame:
        refuse_messages(player, "the frame of motion")
    env = MotionFrame(core) if frame else core
    robot = env.possible_agents[0]
    name = policy if isinstance(policy, str) else repr(policy)
    spaces = env.observation_space(robot), env.action_space(robot)
    demonstrations = Demonstrations(name, scenario, frame, *spaces)
    n_episodes = checked_count("episodes", episodes)
    with one_thread(), ProgressBar(f"Record {name}", n_episodes, "episodes") as progress:
        for number in range(n_episodes):
            demonstrations.episodes.extend(_play(env, player, seed + number))
            demonstrations.delivered.append(core.warehouse.state.delivered)
            progress.reach(number + 1)
    return demonstrations


def _play(
    env: SwarmLogisticsEnv | MotionFrame, policy: Policy, seed: int
) -> Iterator[RobotEpisode]:
    """Play an episode and yield it robot by robot."""
    world = env.unwrapped.warehouse
    observations = [env.reset_arrays(seed)]
    start(policy, world.scenario, seed)
    actions = []
    rewards = []
    failed = []
    ends = []
    while env.agents:
        commands = np.asarray(decide(policy, world.observe(), world.state), np.float64)
        if isinstance(env, MotionFrame):
            commands = _outputs_of(commands, env.turned, world.scenario)
        action = commands.astype(np.float32)  # what is recorded is what is played
        failed.append(world.state.failed.copy())
        rows, earned, terminations, truncations = env.step_arrays(action)
        observations.append(rows)
        actions.append(action)
        rewards.append(earned)
        ends.append((terminations, truncations))
    seen = np.stack(observations)
    done = np.stack(actions)
    paid = np.stack(rewards)
    broken = np.stack(failed)
    terminated, truncated = np.stack(ends, axis=1)
    for robot in range(seen.shape[1]):
        is_end = terminated[:, robot] | truncated[:, robot]
        if not is_end.any():  # it was never there
            continue
        n_steps = int(is_end.argmax()) + 1
        yield RobotEpisode(
            seed,
            robot,
            seen[: n_steps + 1, robot].copy(),
            done[:n_steps, robot].copy(),
            paid[:n_steps, robot].copy(),
            broken[:n_steps, robot].copy(),
            bool(terminated[n_steps - 1, robot]),
        )


def _outputs_of(
    commands: NDArray[np.float64], turned: NDArray[np.float64], scenario: Scenario
) -> NDArray[np.float64]:
    """Return outputs (N, 3) in the frame of motion that ask for the motion of commands (N, 4).

    The direction in which a differential robot wants to drive follows from its turn, as
    `motion.steering.steer` made that. Where it turns as fast as it can, it is taken to want as high
    a speed as goes with a direction at most a quarter off: beyond that it would drive backwards.
    """
    forward, left, turn, gripper = commands[:, :4].T
    is_differential = scenario.of_robots("drive") == "differential"
    if is_differential.any():
        turned_by = turn * scenario.of_robots("max_turn_rate") * scenario.control_period
        off = np.arccos(np.clip(np.abs(forward), 0.0, 1.0))  # of the mean direction
        most = 0.5 * np.pi - 1e-4  # as float32 rounds
        angle = np.minimum(0.5 * np.abs(turned_by) + off, most) * np.sign(turn)
        angle = np.where(np.abs(turn) < 1.0, turned_by, angle)
        speed = forward / np.cos(angle - 0.5 * turned_by)
        forward = np.where(is_differential, speed * np.cos(angle), forward)
        left = np.where(is_differential, speed * np.sin(angle), left)
    cosine = np.cos(turned)
    sine = np.sin(turned)
    return np.stack([cosine * forward + sine * left, cosine * left - sine * forward, gripper], 1)


def _lists(rows: Rows) -> Any:
    import pyarrow as pa

    return pa.FixedSizeListArray.from_arrays(np.ascontiguousarray(rows).ravel(), rows.shape[1])


def _ends(n_steps: int, is_so: bool) -> NDArray[np.bool_]:
    ends = np.zeros(n_steps, np.bool_)
    ends[-1] = is_so
    return ends
