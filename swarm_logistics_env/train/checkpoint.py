"""Checkpoints: all that a training needs to go on as if nothing had happened."""

from __future__ import annotations

import io
import os
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.network_view import NetworkView

FILE_NAME = "checkpoint.pt"


def save_checkpoint(directory: Path, learner: PPO, view: NetworkView, log: Any) -> None:
    """Write a checkpoint, whole or not at all; until then the one before stays.

    To be called between updates: after learning from a batch, before collecting the next; or
    before the first.

    Args:
        log: what else the training remembers; picklable.
    """
    state = {
        "policy": learner.policy.state_dict(),
        "optimizer": learner.policy.optimizer.state_dict(),
        "num_timesteps": learner.num_timesteps,
        "n_updates": learner._n_updates,
        "last_observations": learner._last_obs,
        "last_starts": learner._last_episode_starts,
        "view": _pickled(view),
        "torch": torch.get_rng_state(),
        "cuda": torch.cuda.get_rng_state_all(),
        # stable-baselines3 shuffles minibatches by numpy's global generator.
        "numpy": np.random.get_state(),  # noqa: NPY002
        "python": random.getstate(),
        "log": log,
    }
    part = directory / f"{FILE_NAME}.part"
    with part.open("wb") as file:
        torch.save(state, file)
        file.flush()
        os.fsync(file.fileno())
    part.replace(directory / FILE_NAME)


def read_checkpoint(directory: Path) -> dict[str, Any] | None:
    """Return the checkpoint in a training's directory; None: there is none.

    It is a pickle: resume trainings of your own only.

    Raises:
        TrainingError: it cannot be read.
    """
    path = directory / FILE_NAME
    if not path.exists():
        return None
    try:
        state: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=False)
    except (OSError, RuntimeError, EOFError, pickle.UnpicklingError, AttributeError) as error:
        reason = str(error).splitlines()[0]
        raise TrainingError(
            f"the checkpoint {path} cannot be read ({reason}): train into a new directory"
        ) from error
    return state


def view_of(state: dict[str, Any]) -> NetworkView:
    """Return the worlds as they stood."""
    view: NetworkView = pickle.loads(state["view"])
    return view


def restore(learner: PPO, state: dict[str, Any]) -> None:
    """Bring a learner that was made over `view_of(state)` to where it stood."""
    learner.policy.load_state_dict(state["policy"])
    learner.policy.optimizer.load_state_dict(state["optimizer"])
    learner.num_timesteps = state["num_timesteps"]
    learner._n_updates = state["n_updates"]
    learner._last_obs = state["last_observations"]
    learner._last_episode_starts = state["last_starts"]
    torch.set_rng_state(state["torch"])
    if state["cuda"] and torch.cuda.is_available():
        torch.cuda.set_rng_state_all(state["cuda"])
    np.random.set_state(state["numpy"])  # noqa: NPY002 - see above
    random.setstate(state["python"])


def _pickled(view: NetworkView) -> bytes:
    with io.BytesIO() as buffer:
        pickle.dump(view, buffer)
        return buffer.getvalue()
