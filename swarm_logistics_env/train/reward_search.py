"""The search for the weights of a training's rewards: P against the worst R over failure modes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Self

from pydantic import PositiveInt, model_validator
from rich.console import Console

from swarm_logistics_env.policies import load
from swarm_logistics_env.train.evaluation import evaluate
from swarm_logistics_env.train.run_record import enter
from swarm_logistics_env.train.settings import Part, Scores
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.train.tuning import Trial, search

if TYPE_CHECKING:
    import optuna

FRONT = "front.csv"
OBJECTIVES = ("P", "worst R")
FACTORS = (0.25, 4.0)  # of each weight


class RewardSearch(Part):
    """The specification of a search: each trial is a training of its own, with other weights.

    Each weight of `rewards` and `indicators` of the training is tried between a quarter and four
    times of what it is. Both objectives are measured on the training's evaluation seeds.

    Args:
        training: what is trained; its `evaluation.faults` are the modes of which the worst counts.
        trials: weights to try, the training's own first.

    Raises:
        TrainingError: a field is unknown or cannot be.
    """

    training: Training
    trials: PositiveInt = 12

    @model_validator(mode="after")
    def _has_modes(self) -> Self:
        if not self.training.evaluation.faults:
            raise ValueError("evaluation.faults: should name the modes whose worst R counts")
        return self


def search_rewards(asked: RewardSearch, out: str | Path, *, command: str = "") -> list[Trial]:
    """Search, or go on searching, and return all trials; those on the Pareto front are `is_best`.

    What is in `out` afterwards: trials.sqlite, from which the same call goes on; the directory of
    each trial's training, trial-0 and so on; front.csv, the factors and values of all trials.

    Raises:
        TrainingError: the directory holds another search or cannot be used.
    """
    # Late, as it loads torch.
    from swarm_logistics_env.train.trainer import train

    out, base = Path(out), asked.training
    enter(out, asked, command)

    def try_one(trial: optuna.Trial, number: int) -> tuple[float, ...]:
        factors = {name: trial.suggest_float(name, *FACTORS, log=True) for name in weights(base)}
        # Named by the trials before it, so that one that was cut short goes on from its checkpoint.
        path = train(weighted(base, factors), out / f"trial-{number}", command=command)
        trial.set_user_attr("policy", str(path))
        found = evaluate(load(str(path)), base.scenario, base.evaluation, base.threads)
        if not found.p_o.any():
            return 0.0, -1.0
        return float(found.p_o.mean()), min(found.robustness(mode) for mode in found.faults)

    own = dict.fromkeys(weights(base), 1.0)
    # Lines, as the trainings show live tables.
    lines = Console(stderr=True, force_terminal=False, highlight=False)
    trials = search(out, base.name, OBJECTIVES, asked.trials, base.seed, own, try_one, lines)
    part = out / f"{FRONT}.part"
    with part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["policy", "is_on_front", *OBJECTIVES, *own])
        for trial in trials:
            factors = (trial.parameters[name] for name in own)
            writer.writerow([trial.kept["policy"], trial.is_best, *trial.values, *factors])
    part.replace(out / FRONT)
    return trials


def weights(training: Training) -> dict[str, float]:
    """Return the weights other than 0 of a training's rewards and indicators."""
    paid = {f"rewards.{name}": weight for name, weight in training.rewards.items()}
    if training.indicators is not None:
        named = training.indicators.weights.items()
        paid |= {f"indicators.{name}": weight for name, weight in named}
    return {name: weight for name, weight in paid.items() if weight}


def weighted(training: Training, factors: dict[str, float]) -> Training:
    """Return the training with each weight times its factor, and without scores at its end."""
    changed = {name: weight * factors[name] for name, weight in weights(training).items()}

    def of(table: str) -> dict[str, float]:
        return {n.split(".")[1]: w for n, w in changed.items() if n.split(".")[0] == table}

    indicators = training.indicators
    if indicators is not None:
        indicators = indicators.replace(weights=of("indicators"))
    return training.replace(rewards=of("rewards"), indicators=indicators, scores=Scores(seeds=0))
