"""`swarm-logistics train ...`."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.training import preset_names

if TYPE_CHECKING:
    from swarm_logistics_env.train.training import Training
    from swarm_logistics_env.train.tuning import Trial, Tuning


def train_command(
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
    try:
        if tune is None:
            assert preset is not None
            if trials is None:
                path = train_as_asked(preset, out, seed, steps, device)
                _show_training(path)
            else:
                tried, path = search_as_asked(preset, trials, out, seed, steps)
                _show_trials(f"{preset}, factors of its weights", ("P", "worst R"), tried)
        else:
            fields = {
                "objectives": tuple(objectives) if objectives else None,
                "trials": trials, "seeds": seeds, "seed": seed,
            }  # fmt: skip
            asked, tried, path = tune_as_asked(tune, out, **fields)
            _show_search(asked, tried, path)
    except KeyboardInterrupt:
        typer.echo("\nStopped. The same command goes on.", err=True)
        raise typer.Exit(130) from None
    typer.echo(f"Written: {path}")


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


def train_as_asked(
    asked: str,
    out: Path | None = None,
    seed: int | None = None,
    agent_steps: int | None = None,
    device: str | None = None,
) -> Path:
    """Train a preset, or what a TOML file describes; returns the path of the policy file.

    Args:
        asked: name of the preset, or path of the file.
        out: directory; None: results/train/NAME.
        seed, agent_steps: instead of the training's own.
        device: "cpu" or "cuda"; None: the GPU where there is one.

    Raises:
        TrainingError: there is no such training, it cannot be, or its libraries are missing.
    """
    training = _asked_training(asked, seed, agent_steps)
    out = Path("results/train") / training.name if out is None else out
    words = _words(asked, out, {"--seed": seed, "--steps": agent_steps, "--device": device})
    with _explained():
        import_module("tensorboard")  # missed before anything is written

        from swarm_logistics_env.train.trainer import train
    return train(training, out, command=words, device=device)


def search_as_asked(
    asked: str, trials: int, out: Path | None, seed: int | None, agent_steps: int | None
) -> tuple[list[Trial], Path]:
    """Search the weights of a training's rewards; returns the trials and the table of them.

    Raises:
        TrainingError: as `train_as_asked`, or the training measures no R.
    """
    from swarm_logistics_env.train.reward_search import FRONT, RewardSearch, search_rewards

    training = _asked_training(asked, seed, agent_steps)
    search = RewardSearch(training=training, trials=trials)
    out = Path("results/tune") / training.name if out is None else out
    words = _words(asked, out, {"--seed": seed, "--steps": agent_steps, "--trials": trials})
    with _explained():
        for package in ("optuna", "tensorboard", "stable_baselines3"):
            import_module(package)  # as above
    return search_rewards(search, out, command=words), out / FRONT


def _asked_training(asked: str, seed: int | None, agent_steps: int | None) -> Training:
    from swarm_logistics_env.train.training import load_training

    given = {"seed": seed, "agent_steps": agent_steps}
    return load_training(asked, **{n: value for n, value in given.items() if value is not None})


def _words(asked: str, out: Path, options: dict[str, object]) -> str:
    words = ["swarm-logistics", "train", asked, "--out", str(out)]
    for option, value in options.items():
        if value is not None:
            words += [option, str(value)]
    return shlex.join(words)


def tune_as_asked(
    policy: str, out: Path | None = None, **fields: object
) -> tuple[Tuning, list[Trial], Path]:
    """Search the parameters of a scripted policy; returns what was asked, the trials, the result.

    Args:
        policy: its name.
        out: directory; None: results/tune/NAME.
        fields: of `Tuning`, where they are not None.

    Raises:
        TrainingError: there is no such policy, a field cannot be, or Optuna is missing.
    """
    given: dict[str, Any] = {n: value for n, value in fields.items() if value is not None}
    from swarm_logistics_env.train.tuning import RESULT, Tuning, tune

    asked = Tuning(policy=policy, **given)
    out = Path("results/tune") / policy if out is None else out
    words = ["swarm-logistics", "train", "--tune", policy, "--out", str(out)]
    for name, value in given.items():
        for each in value if isinstance(value, tuple) else (value,):
            words += [f"--{name.removesuffix('s') if name == 'objectives' else name}", str(each)]
    with _explained():
        import_module("optuna")  # as above
    return asked, tune(asked, out, command=shlex.join(words)), out / RESULT


@contextmanager
def _explained() -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        raise TrainingError(
            f"training needs more ({error}): pip install 'swarm-logistics-env[train]'"
        ) from error
