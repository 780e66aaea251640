"""`swarm-logistics train`."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer
from typer import Argument, Exit, Option, echo

from swarm_logistics_env.core.errors import TrainingError, how_to_install
from swarm_logistics_env.policies import read_card
from swarm_logistics_env.study.report.section import P_LEVEL
from swarm_logistics_env.train.training import load_training, preset_names

from .output import STOPPED
from .terminal import show_table


def train_command(
    context: typer.Context,
    preset: Annotated[
        str,
        Argument(
            metavar="PRESET|FILE",
            help=f"Training preset ({', '.join(preset_names())}), or TOML file of one.",
        ),
    ],
    out: Annotated[Path | None, Option(help="Directory; results/train/NAME if not given.")] = None,
    seed: Annotated[int | None, Option(help="Of everything random.")] = None,
    steps: Annotated[int | None, Option(min=1, help="Agent-steps to learn from.")] = None,
    device: Annotated[
        str | None, Option(help="cpu or cuda; the GPU where there is one if not given.")
    ] = None,
    trust_code: Annotated[
        bool, Option("--trust-code", help="Let the file name reward terms of your own code.")
    ] = False,
) -> None:
    """Train a policy; the same command goes on where it was stopped."""
    options = {"seed": seed, "agent_steps": steps}
    fields = {name: value for name, value in options.items() if value is not None}
    training = load_training(preset, trust_code=trust_code, **fields)
    try:
        import_module("tensorboard")  # missed before anything is written
        from swarm_logistics_env.train.trainer import train
    except ModuleNotFoundError as error:
        raise TrainingError(f"training needs more ({error}): {how_to_install('train')}") from error
    out = out or Path("results/train", training.name)
    echo(f"To follow it: tensorboard --logdir {quote(str(out / 'tensorboard'))}")
    try:
        path = train(training, out, command=str(context.obj), device=device)
    except KeyboardInterrupt:
        echo("\nStopped. The same command goes on.", err=True)
        raise Exit(STOPPED) from None
    _show_training(path)
    echo(f"Written: {path}")
    echo(f"Watch it: swarm-logistics watch --policy {quote(str(path))}")
    echo(f"Judge it: swarm-logistics judge {quote(str(path))}")


def _show_training(path: Path) -> None:
    from swarm_logistics_env.train.trainer import PICTURE
    from swarm_logistics_env.train.training_callback import BEST

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
            f"low, high: limits of the {P_LEVEL} interval",
        )
    echo(f"Curve: {path.parent / PICTURE}")
    echo(f"Best on the evaluation's seeds: {path.parent / BEST}")
