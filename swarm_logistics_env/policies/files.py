"""Files of trained policies, in two formats.

Safetensors with the card as JSON in the header execute nothing. Models that stable-baselines3
saved execute the code in them when they are read.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.observations import n_columns
from swarm_logistics_env.policies.learned import LearnedPolicy, PolicyCard, check_tensors
from swarm_logistics_env.records import becoming
from swarm_logistics_env.scenario import Scenario

SUFFIX = ".safetensors"
CARD = "swarm_logistics_policy"  # the header's entry that holds the card
LARGEST_FILE = 64 * 2**20  # bytes; a policy of ours has less than 1 MB


def read_policy(path: Path) -> LearnedPolicy:
    """Return the trained policy in a file; reading one executes nothing that is in it.

    Raises:
        PolicyError: the file cannot be read, is cut short, carries something else, or its numbers
            are not those of the network on its card.
    """
    from safetensors import SafetensorError, safe_open

    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise PolicyError(
                f"{path} has {size} bytes: a policy file should have at most {LARGEST_FILE}"
            )
        with safe_open(path, framework="numpy") as file:
            header = file.metadata() or {}
            if CARD not in header:
                raise PolicyError(
                    f"{path} is safetensors without a card: a policy file should be one that "
                    "`swarm-logistics train` wrote"
                )
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no dict
    except OSError as error:
        reason = error.strerror or error
        raise PolicyError(f"cannot read the policy file {path}: {reason}") from error
    except (SafetensorError, TypeError) as error:
        raise PolicyError(f"{path} is cut short or no safetensors file: {error}") from None
    try:
        return LearnedPolicy(PolicyCard.from_json(header[CARD]), tensors)
    except PolicyError as error:
        raise PolicyError(f"the policy file {path} cannot be used: {error}") from None


def read_card(path: Path) -> PolicyCard:
    """Return the card of a policy file.

    Raises:
        PolicyError: as `read_policy`.
    """
    return read_policy(path).card


def write_policy(path: Path, card: PolicyCard, tensors: Mapping[str, NDArray[np.float32]]) -> None:
    """Write a policy file, whole or not at all.

    Raises:
        PolicyError: the tensors are not those of the network on the card, or it cannot be written.
    """
    from safetensors.numpy import save

    check_tensors(card.network, tensors)
    content = save(
        {name: np.ascontiguousarray(t) for name, t in tensors.items()}, {CARD: card.to_json()}
    )
    with becoming(path, PolicyError) as part:
        part.write_bytes(content)


SB3_SUFFIX = ".zip"


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
            from stable_baselines3 import PPO
        except ImportError:
            raise PolicyError(
                f"{path} needs stable-baselines3: install swarm-logistics-env[train]"
            ) from None
        try:
            self.parameters = {"sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
            self._model: Any = PPO.load(path, device="cpu")
        except Exception as error:  # whatever the code in a file that is none raises
            reason = (str(error) or type(error).__name__).splitlines()[0]
            raise PolicyError(f"{path} is no PPO model of stable-baselines3: {reason}") from error

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
        path: the path of the .zip file. Reading it executes the code in it.

    Raises:
        PolicyError: it cannot be read, has other spaces, or stable-baselines3 is
            missing.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        found = self._model.observation_space.shape, self._model.action_space.shape
        wanted = (n_columns(Scenario()),), (4,)
        if found != wanted:
            raise PolicyError(
                f"{path} maps observations {found[0]} to commands {found[1]}: should map "
                f"{wanted[0]} to {wanted[1]}"
            )
