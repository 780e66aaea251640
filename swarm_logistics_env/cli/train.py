"""`swarm-logistics train ...`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.training import preset_names

if TYPE_CHECKING:
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
    trials: Annotated[int | None, typer.Option(help="With --tune: parameters to try.")] = None,
    seeds: Annotated[int | None, typer.Option(help="With --tune: episodes a condition.")] = None,
) -> None:
    """Train a policy, or tune a scripted one; the same command goes on where it was stopped."""
    from swarm_logistics_env.train.request import train_as_asked, tune_as_asked

    if (preset is None) == (tune is None):
        raise TrainingError(
            f"train: should be given a preset ({', '.join(preset_names())}), a TOML file, or --tune"
        )
    wrong = {
        "--steps": (steps, tune),
        "--device": (device, tune),
        "--objective": (objectives, preset),
        "--trials": (trials, preset),
        "--seeds": (seeds, preset),
    }
    for option, (value, other) in wrong.items():
        if value is not None and other is not None:
            raise TrainingError(f"{option} does not go with {other}")
    try:
        if tune is None:
            assert preset is not None
            path = train_as_asked(preset, out, seed, steps, device)
        else:
            fields = {
                "objectives": tuple(objectives) if objectives else None,
                "trials": trials, "seeds": seeds, "seed": seed,
            }  # fmt: skip
            asked, tried, path = tune_as_asked(tune, out, **fields)
            _show(asked, tried, path)
    except KeyboardInterrupt:
        typer.echo("\nStopped. The same command goes on.", err=True)
        raise typer.Exit(130) from None
    typer.echo(f"Written: {path}")


def _show(asked: Tuning, trials: list[Trial], path: Path) -> None:
    from swarm_logistics_env.cli.terminal_tables import show
    from swarm_logistics_env.policies.tuned import read_tuned
    from swarm_logistics_env.report.result_tables import Section

    names = list(trials[0].parameters)
    shown = [trial for trial in trials if trial.is_best or trial.number == 0]
    rows = tuple(
        (
            "own" if trial.number == 0 else f"trial {trial.number}",
            *(f"{value:.3g}" for value in trial.values),
            *(f"{trial.parameters[name]:.3g}" for name in names),
        )
        for trial in sorted(shown, key=lambda trial: -trial.values[0])
    )
    title = f"{asked.policy}: best of {len(trials)} trials (Pareto front) and its own parameters"
    lines = tuple(
        f"{score.measure} ({score.condition}, {score.seeds} other seeds) = {score.value:.3g}, "
        f"95 % interval {score.low:.3g} to {score.high:.3g}"
        for score in read_tuned(path).scores
        if score.low is not None and score.high is not None
    )
    show(Section(title, ("parameters", *asked.objectives, *names), rows, lines))
