"""Files that stable-baselines3 or its contrib package saved; to read one executes its code."""

from __future__ import annotations

import base64
import importlib
import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from swarm_logistics_env.core.current_folder import allow_all_imports
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, PolicyError, how_to_install
from swarm_logistics_env.policies.models import ModelPolicy, Within, decider_of, within
from swarm_logistics_env.policies.networks import Rows, outputs_of
from swarm_logistics_env.policies.normalizers import normalizer_of
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
    decide = decider_of(model)
    prepare = normalizer_of(normalize)
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
        self._about = path.name

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""

    def act(self, observations: Rows) -> NDArray[Any]:
        """Return an action for each row of observations (N, D)."""
        return outputs_of(self._decide, lambda rows: rows, observations, self._about)


# The class that reads a file, by the module of its policy's class or one of its bases, and by what
# it alone notes in its files, where somebody's own policy has no such base.
_ALGORITHMS = (
    ("sb3_contrib.common.maskable", None, "sb3_contrib", "MaskablePPO"),
    ("sb3_contrib.tqc", "top_quantiles_to_drop_per_net", "sb3_contrib", "TQC"),
    ("sb3_contrib.qrdqn", None, "sb3_contrib", "QRDQN"),
    ("sb3_contrib.crossq", None, "sb3_contrib", "CrossQ"),
    ("sb3_contrib.ars", "delta_std", "sb3_contrib", "ARS"),
    ("stable_baselines3.dqn", "exploration_fraction", "stable_baselines3", "DQN"),
    ("stable_baselines3.sac", "target_entropy", "stable_baselines3", "SAC"),
    ("stable_baselines3.td3", "target_policy_noise", "stable_baselines3", "TD3"),
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
        with allow_all_imports(), one_thread():
            importlib.import_module(package)
            if "recurrent" in str(data["policy_class"].get("__module__")):
                raise PolicyError(
                    f"{path} is recurrent: should have no memory, as each row is a robot"
                )
            objects = {key: _restored(path, key, data[key]) for key in _NEEDED}
            package, name = _algorithm_of(data, objects["policy_class"])
            return getattr(importlib.import_module(package), name).load(path, device="cpu")
    except ModuleNotFoundError as error:
        if error.name != package:
            raise PolicyError(
                f"{path} needs {error.name}, which it was saved with: install it, or put the "
                "folder of that file on PYTHONPATH"
            ) from None
        raise PolicyError(f"{path} needs {package}: {how_to_install('train')}") from None
    except PolicyError:
        raise
    except RAISED_BY_OTHERS as error:  # whatever the code in a file that is none raises
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise PolicyError(f"{path} is no model of stable-baselines3: {reason}") from error


# What a policy is made of. Without them stable-baselines3 warns, and makes another one.
_NEEDED = ("policy_class", "policy_kwargs", "observation_space", "action_space")


def _restored(path: Path, key: str, item: Any) -> Any:
    """Return an object in a file's data.

    Raises:
        PolicyError: it cannot be restored.
        ModuleNotFoundError: its module is missing.
    """
    if not isinstance(item, dict) or ":serialized:" not in item:
        return item
    try:
        return pickle.loads(base64.b64decode(item[":serialized:"]))
    except ModuleNotFoundError:
        raise
    except RAISED_BY_OTHERS as error:
        kind = type(error).__name__
        raise PolicyError(
            f"{path}: its {key} cannot be restored here ({kind}: {error}): should be read with the "
            "code, and the versions of Python and of packages, that it was saved with"
        ) from error


def _algorithm_of(data: dict[str, Any], policy_class: type) -> tuple[str, str]:
    """Return the package and the name of the class that reads a file."""
    for module in [base.__module__ for base in policy_class.__mro__]:
        for begin, _, package, name in _ALGORITHMS:
            if module.startswith(begin):
                return package, name
    for _, noted, package, name in _ALGORITHMS:
        if noted in data:
            return package, name
    return "stable_baselines3", "PPO" if "clip_range" in data else "A2C"


def refuse_untrusted(path: Path, trust_code: bool) -> None:
    """Raise a PolicyError if nobody trusts the code in a file of stable-baselines3."""
    if not trust_code:
        raise PolicyError(
            f"{path} is a file of stable-baselines3: reading it executes the code in it; if you "
            "trust its maker, say so: policies.load(.., trust_code=True) or --trust-code"
        )


def _unpickled(path: Path) -> Any:
    try:
        with allow_all_imports():
            return pickle.loads(path.read_bytes())
    except OSError as error:
        raise PolicyError(f"cannot read {path}: {error.strerror or error}") from error
    except ModuleNotFoundError as error:
        raise PolicyError(
            f"{path} needs {error.name}, which it was saved with: install it"
        ) from None
    except RAISED_BY_OTHERS as error:
        raise PolicyError(f"{path} is no file of VecNormalize.save: {error}") from error
