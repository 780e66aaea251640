"""Files that stable-baselines3 or its contrib package saved; to read one executes its code."""

from __future__ import annotations

import importlib
import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.code_files import allow_all_imports
from swarm_logistics_env.errors import RAISED_BY_OTHERS, PolicyError, how_to_install
from swarm_logistics_env.motion.frame import OUTPUTS
from swarm_logistics_env.motion.network_inputs import INPUTS
from swarm_logistics_env.observations import N_COLUMNS, N_NEIGHBOURS
from swarm_logistics_env.policies.models import (
    ModelPolicy,
    Rows,
    Within,
    decider_of,
    normalizer_of,
    within,
)
from swarm_logistics_env.policies.policy import one_thread

SB3_SUFFIX = ".zip"


def from_sb3(
    path: str | Path,
    *,
    frame: bool = False,
    listens: bool = True,
    normalize: Any = None,
    wrap: Callable[[Any], Any] | None = None,
    trust_code: bool = False,
) -> ModelPolicy | Within:
    """Return the policy of a model that stable-baselines3, or its contrib package, saved.

    Args:
        path: of the .zip file.
        frame, listens: as `of`.
        normalize: as `of`, or the path of the file that `VecNormalize.save` wrote.
        wrap: as `within`, of a model that plays in an environment of its own.
        trust_code: whether to read the files, which executes the code in them.

    Raises:
        PolicyError: a file cannot be read, nobody trusts it, its spaces are others, or
            stable-baselines3 is missing.
    """
    path = Path(path)
    refuse_untrusted(path, trust_code)
    model = read_model(path)
    if isinstance(normalize, str | Path):
        normalize = _unpickled(Path(normalize))
    if wrap is not None:
        return within(model, wrap, normalize=normalize)
    _check_spaces(path, model, frame)
    decide, prepare = decider_of(model), normalizer_of(normalize)
    return ModelPolicy(decide, prepare, about=path.name, frame=frame, listens=listens)


class StableBaselinesModel:
    """A model that stable-baselines3 saved, for a task of its own: rows in, actions out.

    It gives its most likely action for one robot at a time, from the robot's observation row.

    Args:
        path: of the .zip file. Reading it executes the code in it.

    Raises:
        PolicyError: it cannot be read, or stable-baselines3 is missing.
    """

    def __init__(self, path: Path) -> None:
        self._decide = decider_of(read_model(path))

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""

    def act(self, observations: Rows) -> NDArray[Any]:
        """Return an action for each row of observations (N, D)."""
        return np.asarray(self._decide(observations))


# By the module of its networks, the class that reads a file.
_ALGORITHMS = (
    ("sb3_contrib.common.maskable", "sb3_contrib", "MaskablePPO"),
    ("sb3_contrib.tqc", "sb3_contrib", "TQC"),
    ("sb3_contrib.qrdqn", "sb3_contrib", "QRDQN"),
    ("stable_baselines3.dqn", "stable_baselines3", "DQN"),
    ("stable_baselines3.sac", "stable_baselines3", "SAC"),
    ("stable_baselines3.td3", "stable_baselines3", "TD3"),
)


def read_model(path: Path) -> Any:
    """Return the model in a file of stable-baselines3; reading it executes the code in it.

    Raises:
        PolicyError: it cannot be read, or the package that wrote it is missing.
    """
    package = "stable_baselines3"
    try:
        with zipfile.ZipFile(path) as archive:
            data = json.loads(archive.read("data"))
        module = str(data.get("policy_class", {}).get("__module__"))
        if "recurrent" in module:
            raise PolicyError(f"{path} is recurrent: should have no memory, as each row is a robot")
        names = ((p, name) for begin, p, name in _ALGORITHMS if module.startswith(begin))
        default = "PPO" if "clip_range" in data else "A2C"
        package, name = next(names, (package, default))
        with allow_all_imports(), one_thread():
            return getattr(importlib.import_module(package), name).load(path, device="cpu")
    except ModuleNotFoundError as error:
        if error.name != package:
            raise PolicyError(f"{path} needs the package {error.name}: install it") from None
        raise PolicyError(f"{path} needs {package}: {how_to_install('train')}") from None
    except PolicyError:
        raise
    except RAISED_BY_OTHERS as error:  # whatever the code in a file that is none raises
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise PolicyError(f"{path} is no model of stable-baselines3: {reason}") from error


def refuse_untrusted(path: Path, trust_code: bool) -> None:
    """Raise a PolicyError if nobody trusts the code in a file of stable-baselines3."""
    if not trust_code:
        raise PolicyError(
            f"{path} is a file of stable-baselines3: reading it executes the code in it; if you "
            "trust its maker, say so: policies.load(.., trust_code=True) or --trust-code"
        )


def _check_spaces(path: Path, model: Any, frame: bool) -> None:
    """Check that a model maps what it will be given to what is taken."""
    rows, commands = model.observation_space.shape, model.action_space.shape
    is_of_frame = rows == (len(INPUTS),)
    if is_of_frame and not frame:
        raise PolicyError(
            f"{path} reads {len(INPUTS)} inputs, so it learned through MotionFrame: should be "
            "read with frame=True, or --frame"
        )
    if frame and not is_of_frame:
        raise PolicyError(
            f"{path} reads rows of shape {rows}: with frame=True, or --frame, should be "
            f"{len(INPUTS)} inputs, as learned through MotionFrame"
        )
    is_number = commands == ()
    n_messages = 0 if frame or is_number or len(commands) != 1 else commands[0] - 4
    expected = (len(INPUTS),) if frame else (N_COLUMNS + N_NEIGHBOURS * n_messages,)
    taken = (len(OUTPUTS),) if frame else (4 + n_messages,)
    if rows != expected or n_messages < 0 or not (is_number or commands == taken):
        raise PolicyError(
            f"{path} maps observations {rows} to commands {commands}: should map ({N_COLUMNS},) "
            f"to (4,), or through MotionFrame ({len(INPUTS)},) to ({len(OUTPUTS)},); wrappers in "
            "which it learned are named by --env, or policies.within"
        )


def _unpickled(path: Path) -> Any:
    try:
        with allow_all_imports():
            return pickle.loads(path.read_bytes())
    except RAISED_BY_OTHERS as error:
        raise PolicyError(f"{path} is no file of VecNormalize.save: {error}") from error
