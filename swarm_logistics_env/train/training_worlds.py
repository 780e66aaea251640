"""The worlds that a training learns in, and what its networks see of them."""

from __future__ import annotations

import inspect
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box, MultiDiscrete
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.core.streams import generator, key, row_keys
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import faults_among, scenario_fields
from swarm_logistics_env.policies.learned import STREAM
from swarm_logistics_env.train.privileged import PRIVILEGED, fill_privileged, messages_of
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.train.teacher import Teacher
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.world.motion.classes import GROUPS, classes_of, outputs_of
from swarm_logistics_env.world.motion.frame import OUTPUTS, MotionView
from swarm_logistics_env.world.motion.memory import bodies_of
from swarm_logistics_env.world.motion.voices import N_MESSAGES
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.wrappers import IndicatorReward, RunningMeans, SwarmSize, Wrapper


def make_worlds(training: Training) -> SwarmVecEnv:
    """Return the worlds of a training, not yet begun; it raises what `NetworkView` does."""
    worlds = training.each_world
    means: defaultdict[Scenario, RunningMeans] = defaultdict(RunningMeans)

    def make_env(number: int) -> Wrapper:
        kind, scenario = worlds[number]
        conditions = kind.conditions or training.conditions
        indicators = training.indicators
        smallest = scenario if indicators is None else training.smallest_alike(scenario)
        base = smallest if indicators and "S" in indicators.weights else scenario
        env: Wrapper = EpisodeMix(SwarmLogisticsEnv(base, rewards=training.rewards), conditions)
        if indicators is None:
            return env
        if base != scenario:
            env = SwarmSize(env, [kind.n_robots])
        arguments = dict(indicators)
        if indicators.references == "measured":
            arguments["references"] = means[smallest]
        return IndicatorReward(env, **arguments, own_reward=1.0)

    return SwarmVecEnv(make_env=make_env, n_worlds=len(worlds), threads=training.threads)


class EpisodeMix(Wrapper):
    """Plays each episode under conditions drawn from several kinds, by the episode's seed.

    Args:
        env: the environment, or a wrapper of one.
        kinds: what is drawn from; none: every episode is as the environment has it.

    Raises:
        ScenarioError, SetupError: a scenario among them cannot be.
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper, kinds: Sequence[Conditions]) -> None:
        super().__init__(env)
        self._kinds = tuple(kinds)
        weights = np.array([kind.weight for kind in kinds])
        self._shares = weights / weights.sum()
        base = self.unwrapped.scenario
        for kind in kinds:
            for name, values in kind.scenario.items():
                for value in values:
                    self.env.declare_spaces(base.replace(**{name: value}))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's conditions among them."""
        if not self._kinds:
            return options
        rng = generator(seed, "kind of episode")
        kind = self._kinds[int(rng.choice(len(self._kinds), p=self._shares))]
        fields = {
            name: values[int(rng.integers(len(values)))] for name, values in kind.scenario.items()
        }
        faults = faults_among(options, self.unwrapped.faults)
        if kind.modes:
            mode = kind.modes[int(rng.integers(len(kind.modes)))]
            robots = kind.robots[int(rng.integers(len(kind.robots)))]
            faults = (*faults, Fault(mode, robots, onset=float(rng.uniform(*kind.onset))))
        return {**options, "scenario": {**fields, **scenario_fields(options)}, "faults": faults}


def check_finite(name: str, numbers: NDArray[Any]) -> None:
    """Raise a FloatingPointError unless all the numbers are finite."""
    finite = np.isfinite(numbers)
    if not finite.all():
        raise FloatingPointError(f"{name} is {numbers[~finite][0]}")


class NetworkView(VecEnvWrapper):  # type: ignore[misc]  # not in the environment of the type check
    """Turns observation rows into a network's inputs, and its outputs into commands.

    By the code that plays the policy afterwards, so that both see the same. What the value network
    alone reads, `PRIVILEGED`, stands behind these inputs; where a network talks, what it should say
    (`messages_of`) does behind that, and where a teacher pulls, its `labels` come last.

    Args:
        training: whose worlds these are; every robot is a row.

    Attributes:
        frame: of each robot's motion, with its memory.
        teacher: of the training; None where it has nothing to say (any more).
        advice: the outputs (num_envs, 3) that the teacher would give at this decision.

    Raises:
        TrainingError, SetupError, ScenarioError, FaultError: the worlds cannot be.
        FloatingPointError: an observation or a reward is not finite; of `reset` and steps.
    """

    def __init__(self, training: Training) -> None:
        worlds = make_worlds(training)
        network = training.network
        self.frame = MotionView(training.scenario, network.listens, **network.reads)
        self._says_classes = network.says_classes
        self._n_messages = N_MESSAGES if network.talks else 0
        teaching = training.teacher
        self.teacher = None if teaching is None else Teacher(teaching, worlds)
        self.advice = np.zeros((worlds.num_envs, len(OUTPUTS)))
        self._has_labels = teaching is not None and teaching.pull > 0.0
        self._privileged = np.zeros((worlds.num_envs, len(PRIVILEGED)), np.float32)
        self._messages = np.zeros((worlds.num_envs, self._n_messages), np.float32)
        self._n_episodes = 0
        self._seed = 0
        self._n_held = network.decides_every - 1
        n_columns = network.widths[0] + len(PRIVILEGED) + self._n_messages
        n_columns += len(OUTPUTS) if self._has_labels else 0
        actions = Box(-1.0, 1.0, (len(OUTPUTS),), np.float32)
        super().__init__(
            worlds,
            Box(-np.inf, np.inf, (n_columns,), np.float32),
            MultiDiscrete(list(GROUPS)) if self._says_classes else actions,
        )

    def __getstate__(self) -> dict[str, Any]:
        # The base class stores members of the class, which cannot be pickled.
        return {name: value for name, value in vars(self).items() if name != "class_attributes"}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        # This comes first, because the base class looks up missing attributes in `venv`: endlessly
        # if that is missing too.
        self.__dict__.update(saved)
        self.class_attributes = dict(inspect.getmembers(type(self)))

    def seed(self, seed: int | None = None) -> list[int]:
        """Fix all episodes from the next `reset` on."""
        self._n_episodes = 0
        self._seed = seed or 0
        seeds: list[int] = self.venv.seed(seed)
        return seeds

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in every world."""
        observations = self.venv.reset()
        self.frame.begin(self._keys(), self._bodies())
        self._begin_teacher(range(len(self.venv.worlds)))
        return self._read(observations)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the outputs or classes (num_envs, 3) of the step that `step_wait` makes."""
        self.give_outputs(outputs_of(actions) if self._says_classes else actions)

    def give_outputs(self, outputs: NDArray[np.floating]) -> None:
        """Take the outputs (num_envs, 3) of the step that `step_wait` makes."""
        self._outputs = np.hstack([outputs, self._messages])
        self._command()

    def take_messages(self, messages: NDArray[np.float32]) -> None:
        """Take the messages (num_envs, N_MESSAGES) of the next step, before its outputs."""
        self._messages = messages

    def _command(self) -> None:
        self.venv.step_async(self.frame.command(self._outputs))
        if self.teacher is not None:
            self.teacher.note_commands(self.frame.memory)

    def step_wait(self) -> Any:
        """Step every world until the next decision."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for _ in range(self._n_held):
            self.frame.hold(observations)
            if self.teacher is not None:
                self.teacher.act(observations)
            self._command()
            observations, more, dones, infos = self.venv.step_wait()
            rewards = rewards + more
        check_finite("a reward", rewards)
        ended = np.flatnonzero(dones)
        if ended.size:
            last = np.stack([infos[row]["terminal_observation"] for row in ended.tolist()])
            # The value network knows of one step before: the next episode has begun already.
            inputs = np.hstack([self.frame.peek(last, ended), *self._columns_behind(ended)])
            for row, terminal_inputs in zip(ended.tolist(), inputs):
                infos[row]["terminal_observation"] = terminal_inputs
            self.frame.begin_rows(ended, self._keys()[ended], self._bodies()[ended])
            rows_of_worlds = enumerate(self.venv.rows_of_worlds)
            self._begin_teacher([world for world, rows in rows_of_worlds if dones[rows].all()])
        return self._read(observations), rewards, dones, infos

    def change_rewards(self, rewards: Mapping[str, float]) -> None:
        """Pay by other weights from the next step on, in every world."""
        for world in self.venv.worlds:
            world.unwrapped.change_rewards(rewards)

    def _bodies(self) -> NDArray[np.float64]:
        # Every episode may have robots of another kind.
        bodies = np.empty((self.num_envs, 4))
        for world, rows in zip(self.venv.worlds, self.venv.rows_of_worlds):
            bodies[rows] = np.resize(bodies_of(world.warehouse.scenario), bodies[rows].shape)
        return bodies

    def _read(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        inputs = self.frame.read(observations)
        check_finite("an observation", inputs)
        for world, rows in zip(self.venv.worlds, self.venv.rows_of_worlds):
            warehouse = world.warehouse
            turned = self.frame.turned[rows]
            floor = warehouse.floor
            to_delivery = floor.edge - floor.along(warehouse.state.robot_position)
            fill_privileged(warehouse.address, turned, to_delivery, self._privileged[rows])
        if self.teacher is not None:
            self.advice = self.teacher.advise(observations, self.frame.turned)
        return np.hstack([inputs, *self._columns_behind(slice(None))])

    def _columns_behind(self, rows: slice | NDArray[np.int64]) -> list[NDArray[np.float32]]:
        """Return what stands behind the inputs of these rows."""
        columns = [self._privileged[rows], self.true_messages[rows]]
        if self._has_labels:
            columns.append(self.labels[rows])
        return columns

    @property
    def true_messages(self) -> NDArray[np.float32]:
        """What the network should tell (num_envs, N_MESSAGES); (num_envs, 0): it does not talk."""
        if not self._n_messages:  # each step of any training comes by here
            return np.zeros((self.num_envs, 0), np.float32)
        return messages_of(self._privileged)

    @property
    def labels(self) -> NDArray[np.float32]:
        """What the network should say by the teacher's advice (num_envs, 3): outputs or classes."""
        advice = classes_of(self.advice) if self._says_classes else self.advice
        return advice.astype(np.float32)

    def _begin_teacher(self, worlds: Iterable[int]) -> None:
        if self.teacher is not None:
            for world in worlds:
                keys = self.frame.keys[self.venv.rows_of_worlds[world]]
                self.teacher.begin(world, self.venv.worlds[world].warehouse.scenario, keys)

    def _keys(self) -> NDArray[np.uint64]:
        # Every episode of every row gets a stream of its own.
        self._n_episodes += 1
        return row_keys(
            key(self._seed, "training episode", self._n_episodes), STREAM, self.num_envs
        )
