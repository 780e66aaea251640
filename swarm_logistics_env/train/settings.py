"""The tables of a training file: worlds, conditions, PPO and what is measured."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    field_validator,
    model_validator,
)

from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.core.records import Record, each_of
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode

Fraction = Annotated[float, Field(gt=0, le=1)]
Share = Annotated[float, Field(ge=0, le=1)]


def _check_mode(mode: str) -> str:
    failure_mode(mode)
    return mode


Mode = Annotated[str, AfterValidator(_check_mode)]


class Part(Record):
    """A table of a training, or all of it."""

    error_type = TrainingError


class Conditions(Part):
    """Episodes of one kind, among those that a training mixes.

    Args:
        weight: the frequency of this kind, relative to the others.
        modes: failure modes, one of them drawn for each episode; "removed" is the reference P_S.
        robots: numbers m of faulty robots, one of them drawn.
        onset: (earliest, latest) time at which they fail [s], drawn evenly.
        scenario: fields of the scenario with the values that are drawn from.
    """

    weight: PositiveFloat = 1.0
    modes: tuple[Mode, ...] = ()
    robots: Annotated[tuple[PositiveInt, ...], Field(min_length=1)] = (1, 2, 3)
    onset: tuple[NonNegativeFloat, NonNegativeFloat] = (0.0, 0.0)
    scenario: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default_factory=dict)

    @field_validator("onset")
    @classmethod
    def _check_order(cls, onset: tuple[float, float]) -> tuple[float, float]:
        if onset[0] > onset[1]:
            raise ValueError("should be the earliest time, then the latest")
        return onset

    @field_validator("scenario")
    @classmethod
    def _check_values(cls, fields: dict[str, list[Any]]) -> dict[str, list[Any]]:
        for name, values in fields.items():
            if name == "n_robots":
                raise ValueError("swarm sizes belong in `worlds` of the training")
            for value in values:
                Scenario(**{name: value})
        return fields


class WorldKind(Part):
    """Worlds of one kind, among those that stand side by side.

    Args:
        count: how many.
        n_robots: the swarm size.
        scenario: fields in which they differ from the training's scenario; with "preset", from
            that preset.
        conditions: kinds of episodes that are mixed in these worlds; none: the training's.
    """

    count: PositiveInt = 1
    n_robots: PositiveInt = 25
    scenario: dict[str, Any] = Field(default_factory=dict)
    conditions: Annotated[tuple[Conditions, ...], BeforeValidator(each_of(Conditions))] = ()

    @field_validator("scenario")
    @classmethod
    def _check_values(cls, fields: dict[str, Any]) -> dict[str, Any]:
        if "n_robots" in fields:
            raise ValueError("the swarm size is a field of its own, `n_robots`")
        return fields


class Indicators(Part):
    """Indicators as the reward: arguments of `wrappers.IndicatorReward`.

    Args:
        weights: "S", "FT", "R", "A" and "P" with their weights. A is of episodes in which one
            parameter differs. FT is relative to episodes in which robots are "removed", and S to
            the smallest swarm among worlds that are alike but for their size.
        references: P_o of the policy to improve on [items], for R, A and P; or "measured", the
            running means of the policy that learns, in worlds that are alike but for their size.
        credit: the robots that are paid for a delivery: "team" or "deliverer".
        constant: whether to pay an indicator's constant.
    """

    weights: Annotated[dict[Literal["S", "FT", "R", "A", "P"], float], Field(min_length=1)]
    references: PositiveFloat | Literal["measured"]
    credit: Literal["team", "deliverer"] = "team"
    constant: bool = True

    @model_validator(mode="after")
    def _check_references(self) -> Self:
        for name in {"S", "FT"} & self.weights.keys():
            if self.references != "measured":
                raise ValueError(
                    f'references = {self.references}: should be "measured" where {name} is paid, '
                    "which is relative to swarms of another size"
                )
        return self


class PPOSettings(Part):
    """Proximal Policy Optimization (Schulman et al. 2017), as stable-baselines3 has it.

    Args:
        n_steps: control steps between updates; times the rows of all worlds they make a batch.
        n_minibatches: the number of parts that a batch is divided into.
        epochs: the number of passes over a batch.
        learning_rate: the rate at the start; it falls linearly to `final_learning_rate`.
        final_learning_rate: the rate at the end, and before it begins anew.
        restarts: pairs (share of the training, rate) at which the rate begins anew, and with it
            Adam's averages (warm restarts, Loshchilov and Hutter 2017) and the episodes.
        gamma: the discount of a control step.
        gae_lambda: lambda of generalised advantage estimation (Schulman et al. 2016).
        clip: the largest distance from 1 at which the ratio of an action's probabilities pays.
        entropy: the weight of the actions' entropy relative to the policy's loss; it keeps
            exploration up.
        value_weight: the weight of the value network's loss relative to the policy's.
        max_grad_norm: the length to which longer gradients are shortened.
        target_kl: an update stops early beyond 1.5 times this divergence; without it, never.
        deviations: standard deviations of the outputs' exploration noise at the start, one for each
            output; they are learned. A network that says classes has no such noise: this,
            `least_deviation` and `least_until` are refused then.
        least_deviation: the lower limit of deviations at the start and at the end; it changes
            geometrically in between. Without it the noise vanishes long before the policy is good.
        least_until: the share of the training after which the limit stays at its end.
        warm_up: the first updates, in which the value network alone learns. An actor that begins
            with a teacher or a start would forget what it can do if it learned from an untrained
            value network.
        message_weight: the weight of the messages' squared error relative to the policy's loss,
            where a network talks: what it says is learned from what is so, known while it trains.
        value_hidden: widths of the value network, which is not shipped. It reads more than a robot
            can sense, see `privileged.PRIVILEGED`.
    """

    n_steps: PositiveInt = 128
    n_minibatches: PositiveInt = 8
    epochs: PositiveInt = 4
    learning_rate: PositiveFloat = 3e-4
    final_learning_rate: NonNegativeFloat = 0.0
    restarts: tuple[tuple[Fraction, PositiveFloat], ...] = ()
    gamma: Fraction = 0.995
    gae_lambda: Fraction = 0.95
    clip: PositiveFloat = 0.2
    entropy: NonNegativeFloat = 0.0
    value_weight: NonNegativeFloat = 0.5
    max_grad_norm: PositiveFloat = 0.5
    target_kl: PositiveFloat | None = None
    deviations: tuple[PositiveFloat, PositiveFloat, PositiveFloat] = (0.5, 0.5, 0.5)
    least_deviation: tuple[PositiveFloat, PositiveFloat] = (0.001, 0.001)
    least_until: Fraction = 1.0
    warm_up: NonNegativeInt = 30
    message_weight: NonNegativeFloat = 1.0
    value_hidden: tuple[PositiveInt, ...] = (128, 128)

    @field_validator("restarts")
    @classmethod
    def _check_restarts(
        cls, restarts: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        ends = [*(share for share, _ in restarts), 1.0]
        if any(before >= after for before, after in pairwise(ends)):
            raise ValueError("should be one after another, all before the end, 1.0")
        return restarts

    def rate(self, done: float) -> float:
        """Return the learning rate once a share `done` of the training is over."""
        n_restarts = self.restarts_before(done)
        begin, first = ((0.0, self.learning_rate), *self.restarts)[n_restarts]
        end = (*(share for share, _ in self.restarts), 1.0)[n_restarts]
        # The last rollout may pass the end of a training, where the rate would go on to fall.
        progress = min(1.0, (done - begin) / (end - begin))
        return first + progress * (self.final_learning_rate - first)

    def restarts_before(self, done: float) -> int:
        """Return how often the rate began anew before a share `done` of the training was over."""
        return sum(share <= done for share, _ in self.restarts)

    def floor(self, done: float) -> float:
        """Return the least deviation once a share `done` of the training is over."""
        first, last = self.least_deviation
        return first * math.pow(last / first, min(1.0, done / self.least_until))


class Teaching(Part):
    """A script that the network imitates before PPO begins, and is pulled to for a while after.

    Args:
        policy: `homing` or `homing-stock`, or a table of its name and parameters.
        decisions: rows to imitate it upon, which `agent_steps` does not count; 0: none. They are
            kept in memory, some 400 bytes a row.
        shares: of the robots that do what it says meanwhile, at first and at last; the others do
            what the network says.
        noise: standard deviation of noise on what they do meanwhile, half of that on the gripper.
        rate: Adam's learning rate; 0.4 times that in the last quarter.
        epochs: how often a row is learned from, on average over all.
        pull: the weight of the error beside the teacher in PPO's loss at first: the cross entropy
            of classes, or the mean square of outputs; 0: none.
        pull_until: the share of the training at which it has fallen linearly to 0.
    """

    policy: Annotated[PolicySpec, BeforeValidator(PolicySpec.of)]
    decisions: NonNegativeInt = 1_000_000
    shares: tuple[Share, Share] = (1.0, 0.3)
    noise: NonNegativeFloat = 0.15
    rate: PositiveFloat = 1e-3
    epochs: PositiveInt = 10
    pull: NonNegativeFloat = 0.0
    pull_until: Fraction = 1.0

    @field_validator("policy")
    @classmethod
    def _check_policy(cls, policy: PolicySpec) -> PolicySpec:
        if policy.runs_code or not isinstance(policy.load(), Homing):
            raise ValueError(
                f"policy = {policy.title!r}: should be homing or homing-stock, which decide by "
                "rows, remember as networks do and say where to drive"
            )
        return policy

    @property
    def new_script(self) -> Homing:
        """The script, as it is before it has seen anything."""
        script = self.policy.load()
        assert isinstance(script, Homing)
        return script

    def pull_at(self, done: float) -> float:
        """Return the weight of the pull once a share `done` of the training is over."""
        return self.pull * max(0.0, 1.0 - done / self.pull_until)


class Evaluation(Part):
    """What is measured during the training, on seeds of its own.

    Args:
        every: agent-steps between two evaluations.
        seeds: the number of episodes of each evaluation and condition.
        n_robots: the swarm size.
        faults: failure modes with their numbers m of faulty robots; R is measured for each.
    """

    every: PositiveInt = 1_000_000
    seeds: PositiveInt = 4
    n_robots: PositiveInt = 25
    faults: dict[Mode, PositiveInt] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_values(self) -> Self:
        for mode, robots in self.faults.items():
            if robots > self.n_robots:
                raise ValueError(
                    f"faults.{mode} = {robots}: should be at most n_robots = {self.n_robots}"
                )
        return self


class Scores(Part):
    """What is measured at the end and written on the card: a study, on seeds 0, 1, ...

    Args:
        seeds: the number of seeds; with 0 nothing is measured.
        sizes: the swarm sizes N at which P is measured.
        modes: the failure modes for which R and FT are measured at `n_robots`.
        robots: the numbers m of faulty robots for which they are measured.
        n_robots: the swarm size with faults.
    """

    seeds: NonNegativeInt = 30
    sizes: tuple[PositiveInt, ...] = (5, 10, 25, 50, 100)
    modes: tuple[Mode, ...] = ()
    robots: Annotated[tuple[PositiveInt, ...], Field(min_length=1)] = (1, 2, 3)
    n_robots: PositiveInt = 25

    @model_validator(mode="after")
    def _leave_a_working_robot(self) -> Self:
        if self.seeds and self.modes and max(self.robots) >= self.n_robots:
            raise ValueError(
                f"robots = {max(self.robots)}: should be less than n_robots = {self.n_robots}, "
                "or no working robot is left"
            )
        return self
