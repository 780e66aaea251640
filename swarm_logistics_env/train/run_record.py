"""The record in a training's directory of how it was made."""

from __future__ import annotations

import json
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.records import Record
from swarm_logistics_env.tasks.code_version import code_version
from swarm_logistics_env.writing import becoming

FILE_NAME = "training.json"
# Fields that may change when a training goes on, because they change nothing of what was done.
MAY_CHANGE = frozenset({"about", "threads", "scores"})
PACKAGES = (
    "swarm-logistics-env", "torch", "stable-baselines3", "numpy", "numba", "pymunk", "gymnasium",
    "safetensors",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Return the versions of everything that a training's result depends on."""
    found = {"python": platform.python_version(), "simulation": code_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def simulation() -> dict[str, str]:
    """Return those of the versions that say which world was played in."""
    found = versions()
    return {name: found[name] for name in ("swarm-logistics-env", "simulation") if name in found}


def enter(directory: Path, training: Record, command: str) -> bool:
    """Make the directory of a training or search, or enter it to go on; note when and by what.

    Returns:
        Whether it had been begun before.

    Raises:
        TrainingError: it cannot be written, or holds another training.
    """
    path = directory / FILE_NAME
    asked = json.loads(training.to_json())
    record: dict[str, Any] = {"command": command, "training": asked, "sessions": []}
    try:
        directory.mkdir(parents=True, exist_ok=True)
        is_begun = path.exists()
        if is_begun:
            record = json.loads(path.read_text(encoding="utf-8"))
            _check_same(directory, record["training"], asked)
            record |= {"command": command, "training": asked}
        record["sessions"].append(
            {"began": datetime.now(UTC).isoformat(timespec="seconds"), "versions": versions()}
        )
        with becoming(path, TrainingError) as part:
            part.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise TrainingError(f"cannot write to {directory}: {error.strerror}") from error
    except KeyError as error:
        raise TrainingError(f"{path} is no record of a training: it lacks {error}") from error
    except ValueError as error:
        if isinstance(error, TrainingError):
            raise
        raise TrainingError(f"{path} is no record of a training: {error}") from error
    return is_begun


def _check_same(directory: Path, there: dict[str, Any], asked: dict[str, Any]) -> None:
    differing = sorted(n for n in asked if n not in MAY_CHANGE and there.get(n) != asked[n])
    if differing:
        raise TrainingError(
            f"{directory} holds a training with another {', '.join(differing)}: should be the same "
            "to go on, or --out another directory"
        )
