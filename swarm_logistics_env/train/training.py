"""The specification of a training, read from TOML, and its presets."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, PositiveInt, field_validator, model_validator

from swarm_logistics_env.core.errors import (
    PolicyError,
    SwarmLogisticsError,
    TrainingError,
    suggest,
)
from swarm_logistics_env.core.records import FileName, each_of, one_of, read_table
from swarm_logistics_env.environment.rewards import RewardTerms
from swarm_logistics_env.policies.learned import LearnedPolicy, Network
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.train.settings import (
    Conditions,
    Evaluation,
    Fraction,
    Indicators,
    Part,
    PPOSettings,
    Scores,
    Teaching,
    WorldKind,
)
from swarm_logistics_env.world.motion.voices import N_MESSAGES
from swarm_logistics_env.world.scenario import Scenario

PRESETS_FOLDER = Path(__file__).parent / "presets"

# stable-baselines3 shuffles with numpy's global generator, which takes seeds of 32 bits.
Seed = Annotated[int, Field(ge=0, lt=2**32)]


def _scenario_of(fields: object) -> object:
    return WAREHOUSE.vary(Scenario(), fields) if isinstance(fields, dict) else fields


def _start_of(policy: object) -> object:
    if policy is None:
        return None
    start = PolicySpec.of(policy)
    if start.made is not None:
        raise ValueError(f"start = {start.name}: should be a policy's name or the path of its file")
    return start


class Training(Part):
    """Everything that decides the result of a training.

    Args:
        name: the policy's name.
        about: a sentence about the policy, for its card.
        scenario: the conditions; a table of fields makes one, in which "preset" names the scenario
            to start from.
        worlds: kinds of worlds that run side by side. A training begins to learn in easy ones,
            which therefore stand beside the hard ones.
        threads: how many threads step the worlds, and how many processes measure the scores; no
            result depends on it.
        seed: the number that decides everything random.
        agent_steps: decisions of single robots to learn from, over all worlds.
        rewards: task reward: term -> weight, see `rewards.REWARD_TERMS`.
        final_rewards: later weights of those terms whose weight changes, linearly until
            `final_rewards_from`.
        final_rewards_from: the share of the training after which weights change no more.
        indicators: the indicators that are paid beside the task reward; none: the task reward.
        conditions: kinds of episodes that are mixed; none: no robot fails.
        network: what the policy reads and commands.
        start: a policy that `train` wrote, by its name or its path, whose network it goes on from;
            what that does not read begins with weights of 0. Of "ppo-robust@all", which stands for
            n trainings, the one of number `seed` modulo n is taken, by the seeds on their cards.
        teacher: a script that it imitates at first; without it and `start` it learns from nothing.
        ppo: settings of the learner.
        evaluation: what is measured during the training.
        scores: what is measured at its end.
        keep: the network of the policy file: the "last" one, or the "best" one by the evaluations'
            P, which are played with the noise of the policy (`network.exploration`).

    Raises:
        TrainingError: a field is unknown, or its value is not allowed.
    """

    name: FileName = "policy"
    about: str = ""
    scenario: Annotated[Scenario, BeforeValidator(_scenario_of)] = Scenario(restock=True)
    worlds: Annotated[
        tuple[WorldKind, ...], Field(min_length=1), BeforeValidator(each_of(WorldKind))
    ] = (WorldKind(count=6),)
    threads: PositiveInt = 2
    seed: Seed = 0
    agent_steps: PositiveInt = 2_000_000
    rewards: dict[str, float] = Field(default_factory=lambda: {"delivery": 1.0})
    final_rewards: dict[str, float] = Field(default_factory=dict)
    final_rewards_from: Fraction = 1.0
    indicators: Annotated[Indicators | None, BeforeValidator(one_of(Indicators))] = None
    conditions: Annotated[tuple[Conditions, ...], BeforeValidator(each_of(Conditions))] = ()
    network: Annotated[Network, BeforeValidator(one_of(Network))] = Network()
    start: Annotated[PolicySpec | None, BeforeValidator(_start_of)] = None
    teacher: Annotated[Teaching | None, BeforeValidator(one_of(Teaching))] = None
    ppo: Annotated[PPOSettings, BeforeValidator(one_of(PPOSettings))] = PPOSettings()
    evaluation: Annotated[Evaluation, BeforeValidator(one_of(Evaluation))] = Evaluation()
    scores: Annotated[Scores, BeforeValidator(one_of(Scores))] = Scores()
    keep: Literal["last", "best"] = "last"

    @field_validator("rewards")
    @classmethod
    def _check_terms(cls, rewards: dict[str, float]) -> dict[str, float]:
        RewardTerms(rewards)
        return rewards

    @model_validator(mode="after")
    def _check_consistency(self) -> Self:
        size = N_MESSAGES if self.network.talks else 0
        scenarios = [self.scenario, *(scenario for _, scenario in self.each_world)]
        reason = f"network.talks = {str(self.network.talks).lower()}"
        for scenario in scenarios:
            message_size = scenario.message_size
            if message_size != size:
                raise ValueError(
                    f"scenario.message_size = {message_size}: should be {size}, as {reason}"
                )
        self._check_start()
        self._check_ppo()
        self._check_decisions()
        self._check_indicators()
        RewardTerms(self.final_rewards)
        for term in self.final_rewards:
            if term not in self.rewards:
                raise ValueError(f"final_rewards: {term!r} should be among the rewards, too")
        sizes = {self.evaluation.n_robots, *(self.scores.sizes if self.scores.seeds else ())}
        for size in sorted(sizes):
            self.scenario.replace(n_robots=size)
        for world in self.worlds:
            kinds = world.conditions or self.conditions
            most = max((max(kind.robots) for kind in kinds if kind.modes), default=0)
            if most > world.n_robots:
                raise ValueError(
                    f"conditions.robots = {most}: should be at most the smallest swarm, "
                    f"{world.n_robots} robots"
                )
        rows = self.rows * self.ppo.n_steps
        if rows % self.ppo.n_minibatches:
            raise ValueError(
                f"ppo.n_minibatches = {self.ppo.n_minibatches}: should divide the batch of "
                f"{self.rows} robots x {self.ppo.n_steps} steps"
            )
        return self

    def _check_start(self) -> None:
        """Raise a ValueError if the network cannot go on from that of the start."""
        policy = self.start_policy
        if policy is None:
            return
        of_start = policy.card.network
        for name in ("hidden", "head", "listens", "sees_items", "role", "talks"):
            value = getattr(self.network, name)
            value_of_start = getattr(of_start, name)
            reads_more = value is True and value_of_start is False
            if value != value_of_start and not reads_more:
                raise ValueError(
                    f"network.{name} = {value!r}: should be {value_of_start!r}, as "
                    f"{policy.card.name} has, from which it goes on"
                )

    def _check_ppo(self) -> None:
        """Raise a ValueError if a setting of PPO would change nothing."""
        unused = {}
        if not self.network.talks:
            unused["message_weight"] = "network.talks = false"
        if self.start is None and self.teacher is None:
            unused["warm_up"] = "it learns from nothing"
        if self.network.says_classes:
            of_noise = ("deviations", "least_deviation", "least_until")
            unused |= dict.fromkeys(of_noise, 'head = "classes" has no deviations')
        for name, reason in unused.items():
            if getattr(self.ppo, name) != PPOSettings.model_fields[name].default:
                raise ValueError(f"ppo.{name}: should be left out, as {reason}")

    def _check_decisions(self) -> None:
        """Raise a ValueError if an episode could end between two decisions."""
        every = self.network.decides_every
        mixed = [*self.conditions, *(kind for world in self.worlds for kind in world.conditions)]
        changed = {name for kind in mixed for name in kind.scenario}
        ends_between = changed & {"duration", "control_period", "restock"} or any(
            scenario.n_steps % every or not scenario.restock for _, scenario in self.each_world
        )
        if every > 1 and ends_between:
            raise ValueError(
                f"network.decides_every = {every}: should divide the control steps of each episode,"
                " and delivered items should come back, or episodes end between two decisions"
            )

    def _check_indicators(self) -> None:
        """Raise a ValueError if no episode has what an indicator is relative to."""
        weights = self.indicators.weights if self.indicators else {}
        if "S" in weights and all(
            scenario == self.smallest_alike(scenario) for _, scenario in self.each_world
        ):
            raise ValueError(
                "indicators.weights: S should have worlds that differ in n_robots alone, as it is "
                "relative to the smallest of them"
            )
        for world in self.worlds if "FT" in weights else ():
            kinds = world.conditions or self.conditions
            removed = {m for kind in kinds if "removed" in kind.modes for m in kind.robots}
            faulty = {m for kind in kinds if {*kind.modes} - {"removed"} for m in kind.robots}
            for m in sorted(faulty - removed):
                raise ValueError(
                    f'indicators.weights: FT should have conditions with modes = ["removed"], '
                    f"robots = [{m}], as FT of {m} faulty robots is relative to them"
                )

    def rewards_at(self, progress: float) -> dict[str, float]:
        """Return the weights of the reward's terms at a time of the training, from 0 to 1."""
        ends = {**self.rewards, **self.final_rewards}
        change = min(progress / self.final_rewards_from, 1.0)
        return {
            term: weight + change * (ends[term] - weight) for term, weight in self.rewards.items()
        }

    @property
    def start_policy(self) -> LearnedPolicy | None:
        """The policy that it goes on from; None: it begins with an untrained network.

        Raises:
            ValueError: there is no such policy, or `train` did not write it.
        """
        if self.start is None:
            return None
        policies = []
        for start in self.start.trainings or (self.start,):
            try:
                policy = None if start.runs_code else start.load()
            except PolicyError as error:
                raise ValueError(f"start = {start.name!r}: {error}") from error
            if not isinstance(policy, LearnedPolicy):
                raise ValueError(f"start = {start.name!r}: should be a policy that train wrote")
            policies.append(policy)
        policies.sort(key=lambda policy: policy.card.seed)
        return policies[self.seed % len(policies)]

    @property
    def each_world(self) -> tuple[tuple[WorldKind, Scenario], ...]:
        """The kind and the scenario of every world."""
        return tuple(
            (kind, WAREHOUSE.vary(self.scenario, {"n_robots": kind.n_robots, **kind.scenario}))
            for kind in self.worlds
            for _ in range(kind.count)
        )

    def smallest_alike(self, scenario: Scenario) -> Scenario:
        """Return the smallest of the worlds' scenarios that differ from one in `n_robots` alone."""
        fields = scenario.model_dump(exclude={"n_robots"})
        alike = [
            of_world
            for _, of_world in self.each_world
            if of_world.model_dump(exclude={"n_robots"}) == fields
        ]
        return min(alike, key=lambda of_world: of_world.n_robots)

    @property
    def evaluation_scenario(self) -> Scenario:
        """The scenario with the swarm size at which it is measured during the training."""
        return self.scenario.replace(n_robots=self.evaluation.n_robots)

    @property
    def rows(self) -> int:
        """The number of robots in all worlds together."""
        return sum(kind.count * kind.n_robots for kind in self.worlds)


def preset_names() -> list[str]:
    """Return the names of the trainings that come with the package."""
    return sorted(path.stem for path in PRESETS_FOLDER.glob("*.toml"))


def load_training(source: str, *, trust_code: bool = False, **fields: object) -> Training:
    """Return a preset by its name, or the training in a TOML file, with some fields changed.

    A file with `preset = "robust"` has the fields of that preset, in tables as well, where it says
    nothing else; name and about are its own. Lists, as those of worlds, are replaced whole.

    Args:
        trust_code: whether a file may name reward terms that are code, which runs it.

    Raises:
        TrainingError: there is none, it is not TOML, or a field of it is unknown or cannot be; or
            it names code that nobody trusts.
    """
    path = Path(source) if source.endswith(".toml") else _preset_path(source)
    fields_of_file = _read_fields(path)
    terms = fields_of_file.get("rewards", {})
    code = [str(term) for term in terms if ":" in str(term)] if isinstance(terms, dict) else []
    if code and not trust_code:
        raise TrainingError(
            f"{path.name}: the reward term {code[0]!r} is code, which runs when it is loaded: "
            "should be allowed by --trust-code (trust_code=True)"
        )
    try:
        return Training(**{"name": path.stem, **fields_of_file, **fields})
    except SwarmLogisticsError as error:  # whichever record of it refuses
        raise TrainingError(f"{path.name}: {error}") from error


def _preset_path(name: str) -> Path:
    if name not in preset_names():
        raise TrainingError(f"no training preset {name!r}{suggest(name, preset_names())}")
    return PRESETS_FOLDER / f"{name}.toml"


def _read_fields(path: Path) -> dict[str, Any]:
    """Return the fields of a training file, with those of the preset that it changes."""
    fields = read_table(path, "training", TrainingError)
    preset = fields.pop("preset", None)
    if preset is None:
        return fields
    if not isinstance(preset, str):
        raise TrainingError(f"{path.name}: preset = {preset!r}: should be a text, as 'robust'")
    of_preset = _read_fields(_preset_path(preset))
    merged = {**of_preset, "name": path.stem, "about": ""}
    for name, value in fields.items():
        table = merged.get(name)
        if isinstance(value, dict) and isinstance(table, dict):
            merged[name] = {**table, **value}
        else:
            merged[name] = value
    return merged
