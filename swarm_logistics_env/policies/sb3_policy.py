"""Policies that stable-baselines3 saved: reading such a file executes the code in it."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.observations import n_columns
from swarm_logistics_env.scenario import Scenario

SUFFIX = ".zip"


class StableBaselinesModel:
    """A PPO model that stable-baselines3 saved; it gives its most likely action each time.

    It decides for one robot at a time, from the robot's observation row.

    Args:
        path: of the .zip file. Reading it executes the code in it.

    Raises:
        PolicyError: it cannot be read, or stable-baselines3 is missing.
    """

    def __init__(self, path: Path) -> None:
        try:
            self.parameters = {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
        except OSError as error:
            raise PolicyError(f"cannot read the policy file {path}: {error.strerror}") from error
        self._model = read_model(path)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""

    def act(self, observations: NDArray[np.float32]) -> NDArray[Any]:
        """Return an action for each row of observations (N, D)."""
        actions, _ = self._model.predict(observations, deterministic=True)
        return np.asarray(actions)


class StableBaselinesPolicy(StableBaselinesModel):
    """A model for the warehouse.

    It should have learned from bare observation rows (D,) to give commands (4,), as from
    `adapters.SwarmVecEnv`; what normalised its observations is not in the file.

    Args:
        path: the path of the .zip file.
        trust_code: whether to read the file, which executes the code in it.

    Raises:
        PolicyError: it is not trusted, cannot be read, has other spaces, or stable-baselines3 is
            missing.
    """

    def __init__(self, path: Path, *, trust_code: bool = False) -> None:
        if not trust_code:
            raise PolicyError(
                f"{path} is a file of stable-baselines3: reading it executes the code in it; if "
                "you trust its maker, say so: policies.load(.., trust_code=True) or --trust-code"
            )
        super().__init__(path)
        found = self._model.observation_space.shape, self._model.action_space.shape
        wanted = (n_columns(Scenario()),), (4,)
        if found != wanted:
            raise PolicyError(
                f"{path} maps observations {found[0]} to commands {found[1]}: should map "
                f"{wanted[0]} to {wanted[1]}"
            )


def read_model(path: Path) -> Any:
    """Return the PPO model in a file, which executes the code in it.

    Raises:
        PolicyError: it is none, or stable-baselines3 is missing.
    """
    try:
        from stable_baselines3 import PPO
    except ImportError:
        raise PolicyError(
            f"{path} needs stable-baselines3: install swarm-logistics-env[train]"
        ) from None
    import pickle
    import zipfile

    try:
        return PPO.load(path, device="cpu")
    except (
        ValueError, KeyError, TypeError, AttributeError, RuntimeError, ImportError, EOFError,
        OSError, zipfile.BadZipFile, pickle.UnpicklingError,
    ) as error:  # fmt: skip
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise PolicyError(f"{path} is no PPO model of stable-baselines3: {reason}") from None
