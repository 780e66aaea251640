"""`swarm-logistics train ...`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.training import preset_names

if TYPE_CHECKING:
    from swarm_logistics_env.train.tuning import Trial, Tuning


def train_command(
    context: typer.Context,
    preset: Annotated[
        str | None,
        typer.Argument(
            metavar="PRESET|FILE",
            help=f"Training preset ({', '.join(preset_names())}), or TOML file of one.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory; results/train/NAME if not given.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of everything random.")] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Agent-steps to learn from.")] = None,
    device: Annotated[
        str | None, typer.Option(help="cpu or cuda; the GPU where there is one if not given.")
    ] = None,
    tune: Annotated[
        str | None,
        typer.Option(metavar="POLICY", help="Search a scripted policy's parameters instead."),
    ] = None,
    objectives: Annotated[
        list[str] | None,
        typer.Option("--objective", help="With --tune: P, R or FT; may be repeated."),
    ] = None,
    trials: Annotated[
        int | None,
        typer.Option(
            help="Parameters to try; with a training: weights of its rewards to try, for P and the "
            "worst R."
        ),
    ] = None,
    seeds: Annotated[int | None, typer.Option(help="With --tune: episodes a condition.")] = None,
) -> None:
    """Train a policy, or tune a scripted one; the same command goes on where it was stopped."""
    if (preset is None) == (tune is None):
        raise TrainingError(
            f"train: should be given a preset ({', '.join(preset_names())}), a TOML file, or --tune"
        )
    wrong = {
        "--steps": (steps, tune),
        "--device": (device, tune if trials is None else tune or "--trials"),
        "--objective": (objectives, preset),
        "--seeds": (seeds, preset),
    }
    for option, (value, other) in wrong.items():
        if value is not None and other is not None:
            raise TrainingError(f"{option} does not go with {other}")
    command, of_training = str(context.obj), _given(seed=seed, agent_steps=steps)
    try:
        if tune is not None:
            fields = _given(objectives=objectives, trials=trials, seeds=seeds, seed=seed)
            path = _tune(tune, out, command, fields)
        elif trials is not None:
            path = _search(str(preset), trials, out, command, of_training)
        else:
            path = _train(str(preset), out, command, device, of_training)
    except KeyboardInterrupt:
        typer.echo("\nStopped. The same command goes on.", err=True)
        raise typer.Exit(130) from None
    typer.echo(f"Written: {path}")


def _given(**fields: Any) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value is not None}


def _train(
    asked: str, out: Path | None, command: str, device: str | None, fields: dict[str, Any]
) -> Path:
    """Train a preset, or what a TOML file describes, and show it; return the policy file's path."""
    from swarm_logistics_env.train.training import load_training

    training = load_training(asked, **fields)
    with _explained():
        import_module("tensorboard")  # missed before anything is written
        from swarm_logistics_env.train.trainer import train
    path = train(
        training, out or Path("results/train", training.name), command=command, device=device
    )
    _show_training(path)
    return path


def _search(
    asked: str, trials: int, out: Path | None, command: str, fields: dict[str, Any]
) -> Path:
    """Search the weights of a training's rewards, and show it; return the path of its table."""
    from swarm_logistics_env.train.reward_search import (
        FRONT,
        OBJECTIVES,
        RewardSearch,
        search_rewards,
    )
    from swarm_logistics_env.train.training import load_training

    search = RewardSearch(training=load_training(asked, **fields), trials=trials)
    with _explained():
        for package in ("optuna", "tensorboard", "stable_baselines3"):
            import_module(package)  # as above
    out = out or Path("results/tune", search.training.name)
    tried = search_rewards(search, out, command=command)
    _show_trials(f"{asked}, factors of its weights", OBJECTIVES, tried)
    return out / FRONT


def _tune(policy: str, out: Path | None, command: str, fields: dict[str, Any]) -> Path:
    """Search the parameters of a scripted policy, and show it; return the path of the result."""
    from swarm_logistics_env.train.tuning import RESULT, Tuning, tune

    asked = Tuning(policy=policy, **fields)
    with _explained():
        import_module("optuna")  # as above
    out = out or Path("results/tune", policy)
    tried = tune(asked, out, command=command)
    _show_search(asked, tried, out / RESULT)
    return out / RESULT


def _show_search(asked: Tuning, trials: list[Trial], path: Path) -> None:
    from swarm_logistics_env.policies.tuned import read_tuned

    lines = (
        f"{score.measure} ({score.condition}, {score.seeds} other seeds) = {score.value:.3g}, "
        f"95 % interval {score.low:.3g} to {score.high:.3g}"
        for score in read_tuned(path).scores
        if score.low is not None and score.high is not None
    )
    _show_trials(asked.policy, asked.objectives, trials, *lines)


def _show_trials(what: str, objectives: tuple[str, ...], trials: list[Trial], *lines: str) -> None:
    from .terminal_tables import show_table

    names = list(trials[0].parameters)
    shown = [trial for place, trial in enumerate(trials) if trial.is_best or place == 0]
    rows = (
        (
            "own" if trial is trials[0] else f"trial {trial.number}",
            *(f"{value:.3g}" for value in trial.values),
            *(f"{trial.parameters[name]:.3g}" for name in names),
        )
        for trial in sorted(shown, key=lambda trial: -trial.values[0])
    )
    title = f"{what}: best of {len(trials)} trials (Pareto front) and its own parameters"
    show_table(title, ("parameters", *objectives, *names), rows, *lines)


def _show_training(path: Path) -> None:
    from swarm_logistics_env.policies import read_card
    from swarm_logistics_env.train.curve import BEST, PICTURE

    from .terminal_tables import show_table

    card = read_card(path)
    rows = tuple(
        (
            score.measure,
            score.condition,
            f"{score.value:.3g}",
            *("-" if limit is None else f"{limit:.3g}" for limit in (score.low, score.high)),
            str(score.seeds),
        )
        for score in card.scores
    )
    if rows:
        show_table(
            f"{card.name}: scores on seeds it was not trained on",
            ("measure", "condition", "value", "low", "high", "seeds"),
            rows,
            "low, high: limits of the 95 % interval",
        )
    typer.echo(f"Curve: {path.parent / PICTURE}")
    typer.echo(f"Best on the evaluation's seeds: {path.parent / BEST}")


@contextmanager
def _explained() -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        raise TrainingError(
            f"training needs more ({error}): pip install 'swarm-logistics-env[train]'"
        ) from error
