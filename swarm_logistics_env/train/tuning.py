"""The search for a scripted policy's parameters, against P and indicators at once."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, NonNegativeInt, PositiveInt, field_validator

from swarm_logistics_env import policies, spi
from swarm_logistics_env.errors import suggest
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.policies.card import Score
from swarm_logistics_env.policies.tuned import TunedPolicy
from swarm_logistics_env.records import one_of
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.train.evaluation import Evaluated, evaluate, performances
from swarm_logistics_env.train.live_table import LiveTable
from swarm_logistics_env.train.run_record import enter, versions
from swarm_logistics_env.train.settings import Evaluation, Modes, Part
from swarm_logistics_env.train.training import Seed

if TYPE_CHECKING:
    import optuna
    from rich.console import Console

STORAGE = "trials.sqlite"
RESULT = "result.json"

# The range (lowest, highest) in which each parameter of Swarm D-T is searched, around its default.
RANGES: Mapping[str, tuple[float, float]] = {
    "diffusion": (0.05, 3.0),
    "avoidance_gain": (0.0, 5.0),
    "avoidance_range": (0.25, 1.0),
    "wall_distance": (0.13, 0.6),
    "taxis_gain": (0.1, 3.0),
    "drop_rate": (0.1, 10.0),
}
Objective = Literal["P", "R", "FT"]


class Tuning(Part):
    """The specification of a search.

    Args:
        policy: name of the scripted policy.
        objectives: all maximised: P without faults, and the means over `modes` of R and FT.
        trials: parameters to try, the policy's own first.
        seeds: episodes of each trial under each condition, the same for all trials.
        scenario: the conditions.
        modes, robots: failure modes and the number m of faulty robots.
        seed: of the search.
        threads: in which episodes are played; no result depends on it.
        confirm: seeds 0, 1, .. on which the best is then measured beside the policy's own
            parameters; the search uses others.

    Raises:
        TrainingError: a field is unknown or cannot be.
    """

    policy: str
    objectives: Annotated[tuple[Objective, ...], Field(min_length=1)] = ("P", "R")
    trials: PositiveInt = 60
    seeds: PositiveInt = 8
    scenario: Annotated[Scenario, BeforeValidator(one_of(Scenario))] = Scenario(restock=True)
    modes: Annotated[Modes, Field(min_length=1)] = ("FM1", "FM2", "FM3", "FM4")
    robots: PositiveInt = 2
    seed: Seed = 0
    threads: PositiveInt = 2
    confirm: NonNegativeInt = 30

    @field_validator("policy")
    @classmethod
    def _scripted(cls, policy: str) -> str:
        known = [name for name in policies.NAMES if isinstance(policies.load(name), SwarmDT)]
        if policy not in known:
            raise ValueError(f"no policy to tune{suggest(policy, known)}")
        return policy


@dataclass(frozen=True)
class Trial:
    """Parameters that were tried, their value for each objective, and what was kept of them."""

    number: int
    parameters: dict[str, float]
    values: tuple[float, ...]
    is_best: bool
    kept: dict[str, Any]


def tune(asked: Tuning, out: str | Path, *, command: str = "") -> list[Trial]:
    """Search, or go on searching, and return all trials; those on the Pareto front are `is_best`.

    What is in `out` afterwards: trials.sqlite, a study of Optuna's, from which the same call goes
    on after a crash; result.json, a policy file with the best parameters by the first objective.

    Raises:
        TrainingError: the directory holds another search or cannot be used.
    """
    out = Path(out)
    enter(out, asked, command)

    def try_one(trial: optuna.Trial, number: int) -> tuple[float, ...]:
        return _try(trial, asked)

    own = _own_parameters(asked.policy)
    trials = search(out, asked.policy, asked.objectives, asked.trials, asked.seed, own, try_one)
    best = max(trials, key=lambda trial: trial.values[0])
    record = TunedPolicy(
        policy=asked.policy,
        parameters=best.parameters,
        command=command,
        versions=versions(),
        search=json.loads(asked.to_json()),
        scores=confirm(asked.policy, best.parameters, asked.scenario, asked.confirm, asked.threads)
        if asked.confirm
        else (),
    )
    part = out / f"{RESULT}.part"
    part.write_text(json.dumps(json.loads(record.to_json()), indent=2) + "\n", encoding="utf-8")
    part.replace(out / RESULT)
    return trials


def search(
    out: Path,
    name: str,
    objectives: Sequence[str],
    n_trials: int,
    seed: int,
    own: dict[str, float],
    try_one: Callable[[optuna.Trial, int], tuple[float, ...]],
    console: Console | None = None,
) -> list[Trial]:
    """Try parameters until there are `n_trials`, and return them all; or go on with it.

    Args:
        out: the directory of the search's storage.
        objectives: names of what is maximised.
        own: the parameters that are tried first.
        try_one: takes a trial to ask for its parameters, and the number of trials before it;
            returns the values of the objectives.
        console: the console that shows how far it is; None means standard error.
    """
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(
        study_name=name,
        storage=f"sqlite:///{(out / STORAGE).resolve()}",
        directions=["maximize"] * len(objectives),
        load_if_exists=True,
    )
    for cut_short in study.get_trials(states=[optuna.trial.TrialState.RUNNING]):
        study.tell(cut_short.number, state=optuna.trial.TrialState.FAIL)
    done = len(_completed(study))
    if not done and not study.get_trials(states=[optuna.trial.TrialState.WAITING]):
        study.enqueue_trial(own)
    with LiveTable(f"tuning {name}", n_trials, "trials", done=done, console=console) as table:
        while done < n_trials:
            # Each has its own sampler, so that a search that was stopped goes on as it would have.
            study.sampler = optuna.samplers.TPESampler(seed=(seed * 100_003 + done) % 2**32)
            trial = study.ask()
            values = try_one(trial, done)
            study.tell(trial, values)
            done += 1
            table.reach(done)
            table.measured(dict(zip(objectives, values)))
    best = {trial.number for trial in study.best_trials}
    return [
        Trial(t.number, dict(t.params), tuple(t.values), t.number in best, dict(t.user_attrs))
        for t in _completed(study)
    ]


def values_of(asked: Tuning, found: Evaluated) -> tuple[float, ...]:
    """Return the objectives' values, nothing delivered counting as the worst."""
    if not found.p_o.any():
        return tuple(0.0 if objective == "P" else -1.0 for objective in asked.objectives)
    values: dict[str, Callable[[], Any]] = {
        "P": found.p_o.mean,
        "R": lambda: np.mean([found.robustness(mode) for mode in asked.modes]),
        "FT": lambda: np.mean([found.fault_tolerance(mode) for mode in asked.modes]),
    }
    return tuple(float(values[objective]()) for objective in asked.objectives)


def confirm(
    policy: str, parameters: dict[str, Any], scenario: Scenario, n_seeds: int, threads: int
) -> tuple[Score, ...]:
    """Return P with these parameters and with the policy's own, and the change, on seeds 0, 1, ..

    The best of many trials looks better than it is, on the seeds of the search.
    """
    p_own, p_best = (
        performances(made, scenario, [()], range(n_seeds), threads)[0]
        for made in (policies.load(policy), policies.load(policy, **parameters))
    )
    measured: list[tuple[str, str, Any]] = [
        ("P", "tuned", spi.mean_interval(p_best)),
        ("P", "own parameters", spi.mean_interval(p_own)),
    ]
    if p_own.any():
        change = spi.relative_change(p_own, p_best)
        measured.append(("change", "tuned against own parameters", change))
    return tuple(
        Score(
            measure=measure,
            condition=f"N = {scenario.n_robots}, no fault, {which}",
            value=found.value,
            low=found.low,
            high=found.high,
            seeds=n_seeds,
        )
        for measure, which, found in measured
    )


def _try(trial: optuna.Trial, asked: Tuning) -> tuple[float, ...]:
    parameters: dict[str, Any] = {name: trial.suggest_float(name, *RANGES[name]) for name in RANGES}
    needs_faults = asked.objectives != ("P",)
    faults = dict.fromkeys((*asked.modes, "removed"), asked.robots) if needs_faults else {}
    evaluation = Evaluation(seeds=asked.seeds, n_robots=asked.scenario.n_robots, faults=faults)
    policy = policies.load(asked.policy, **parameters)
    return values_of(asked, evaluate(policy, asked.scenario, evaluation, asked.threads))


def _own_parameters(policy: str) -> dict[str, Any]:
    made: Any = policies.load(policy)
    return {
        name: min(max(getattr(made.parameters, name), low), high)
        for name, (low, high) in RANGES.items()
    }


def _completed(study: optuna.Study) -> list[Any]:
    import optuna

    return list(study.get_trials(states=[optuna.trial.TrialState.COMPLETE]))
