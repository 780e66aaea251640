"""Trainings as TOML files: those that come with the package, and one's own."""

from __future__ import annotations

import tomllib
from pathlib import Path

from swarm_logistics_env.errors import SwarmLogisticsError, TrainingError, suggest
from swarm_logistics_env.train.training import Training

PRESETS = Path(__file__).parent / "presets"


def preset_names() -> list[str]:
    """Return the names of the trainings that come with the package."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def load_training(asked: str, **fields: object) -> Training:
    """Return a preset by its name, or the training in a TOML file, with some fields changed.

    Raises:
        TrainingError: there is none, it is not TOML, or a field of it is unknown or cannot be.
    """
    path = Path(asked) if asked.endswith(".toml") else PRESETS / f"{asked}.toml"
    if path.parent == PRESETS and path.stem not in preset_names():
        raise TrainingError(f"no training preset {asked!r}{suggest(asked, preset_names())}")
    try:
        given = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise TrainingError(f"cannot read the training {path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = str(error).splitlines()[0]
        raise TrainingError(f"the training {path} is not TOML: {reason}") from error
    try:
        return Training(**{"name": path.stem, **given, **fields})
    except SwarmLogisticsError as error:  # whichever record of it refuses
        raise TrainingError(f"{path.name}: {error}") from error
