"""A training as a command line asks for it."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.training import load_training
from swarm_logistics_env.train.tuning import RESULT, Trial, Tuning, tune


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
    given = {"seed": seed, "agent_steps": agent_steps}
    changes = {name: value for name, value in given.items() if value is not None}
    training = load_training(asked, **changes)
    out = Path("results/train") / training.name if out is None else out
    words = ["swarm-logistics", "train", asked, "--out", str(out)]
    for option, value in (("--seed", seed), ("--steps", agent_steps), ("--device", device)):
        if value is not None:
            words += [option, str(value)]
    with _explained():
        import_module("tensorboard")  # missed before anything is written

        from swarm_logistics_env.train.trainer import train
    return train(training, out, command=shlex.join(words), device=device)


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
