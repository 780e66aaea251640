"""The specification of a training: one validated record, read from TOML."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, PositiveInt, field_validator, model_validator

from swarm_logistics_env.environment.rewards import RewardTerms
from swarm_logistics_env.policies.card import Network
from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.train.settings import (
    Conditions,
    Evaluation,
    Imitation,
    Indicators,
    Part,
    PPOSettings,
    Scores,
)

# stable-baselines3 shuffles with numpy's global generator, which takes seeds of 32 bits.
Seed = Annotated[int, Field(ge=0, lt=2**32)]


def as_scenario(value: object) -> object:
    """Return the scenario of a table of fields; anything else as it is."""
    return Scenario(**value) if isinstance(value, dict) else value


def _one(record: type[Record]) -> Callable[[object], object]:
    # The record's own constructor raises errors that suggest the field that was meant.
    return lambda value: record(**value) if isinstance(value, dict) else value


def _each(record: type[Record]) -> Callable[[object], object]:
    one = _one(record)
    return lambda values: (
        tuple(one(value) for value in values) if isinstance(values, list | tuple) else values
    )


class Training(Part):
    """Everything that decides the result of a training.

    Args:
        name: of the policy.
        about: what it is, for its card.
        scenario: the conditions; a table of fields makes one.
        sizes: swarm sizes that the worlds have in turn.
        worlds: how many run side by side.
        threads: in which worlds step, and processes that measure scores; no result depends on it.
        seed: of everything random.
        agent_steps: decisions of single robots to learn from, over all worlds.
        rewards: task reward: term -> weight, see `rewards.REWARD_TERMS`. With `indicators` it is
            added to them.
        indicators: pays them instead of the task.
        conditions: kinds of episodes that are mixed; none: nobody fails.
        imitation: what comes before PPO; none: it learns from scratch.
        network: what the policy reads and commands.
        ppo, evaluation, scores: see there.

    Raises:
        TrainingError: a field is unknown or cannot be.
    """

    name: str = "policy"
    about: str = ""
    scenario: Annotated[Scenario, BeforeValidator(as_scenario)] = Scenario(restock=True)
    sizes: Annotated[tuple[PositiveInt, ...], Field(min_length=1)] = (25,)
    worlds: PositiveInt = 6
    threads: PositiveInt = 2
    seed: Seed = 0
    agent_steps: PositiveInt = 2_000_000
    rewards: dict[str, float] = Field(default_factory=lambda: {"delivery": 1.0})
    indicators: Annotated[Indicators | None, BeforeValidator(_one(Indicators))] = None
    conditions: Annotated[tuple[Conditions, ...], BeforeValidator(_each(Conditions))] = ()
    imitation: Annotated[Imitation | None, BeforeValidator(_one(Imitation))] = None
    network: Annotated[Network, BeforeValidator(_one(Network))] = Network()
    ppo: Annotated[PPOSettings, BeforeValidator(_one(PPOSettings))] = PPOSettings()
    evaluation: Annotated[Evaluation, BeforeValidator(_one(Evaluation))] = Evaluation()
    scores: Annotated[Scores, BeforeValidator(_one(Scores))] = Scores()

    @field_validator("name")
    @classmethod
    def _file_name(cls, name: str) -> str:
        if not name or not name.replace("-", "").replace("_", "").isalnum():
            raise ValueError("should be of letters, digits, - and _: the policy file is called so")
        return name

    @field_validator("rewards")
    @classmethod
    def _terms(cls, rewards: dict[str, float]) -> dict[str, float]:
        RewardTerms(rewards)
        return rewards

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.sizes) > self.worlds:
            raise ValueError(
                f"worlds = {self.worlds}: should be at least {len(self.sizes)}, one for each size"
            )
        if self.scenario.message_size:
            raise ValueError("scenario.message_size: should be 0, the network sends no messages")
        played = {self.evaluation.n_robots, *(self.scores.sizes if self.scores.seeds else ())}
        if self.imitation is not None:
            played |= set(self.imitation.sizes)
            if self.imitation.seconds < self.scenario.control_period:
                raise ValueError(
                    f"imitation.seconds = {self.imitation.seconds}: should be at least the "
                    f"control period, {self.scenario.control_period} s"
                )
        for size in sorted(played):
            self.scenario.replace(n_robots=size)
        most = max((max(kind.robots) for kind in self.conditions if kind.modes), default=0)
        if most > min(self.sizes):
            raise ValueError(
                f"conditions.robots = {most}: should be at most the smallest swarm, "
                f"{min(self.sizes)} robots"
            )
        rows = self.rows * self.ppo.n_steps
        if rows % self.ppo.n_minibatches:
            raise ValueError(
                f"ppo.n_minibatches = {self.ppo.n_minibatches}: should divide the batch of "
                f"{self.rows} robots x {self.ppo.n_steps} steps"
            )
        return self

    @property
    def rows(self) -> int:
        """Robots in all worlds together."""
        return sum(self.sizes[world % len(self.sizes)] for world in range(self.worlds))
