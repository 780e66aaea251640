"""The policies that a command line means."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from pydantic import JsonValue
from typer import Option

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.sb3_files import SB3_SUFFIX

PolicyOption = Annotated[
    str, Option(help="Name (`list policies`), path of a file, module:Class, my.py:Class or c:my.c.")
]
TrustOption = Annotated[
    bool,
    Option(
        "--trust-code",
        help="Let a file run code: a .zip policy, or what a study names as package.mod:NAME.",
    ),
]


FrameOption = Annotated[
    bool, Option("--frame", help="A .zip model learned through MotionFrame, so it plays in one.")
]
NormalizeOption = Annotated[
    Path | None,
    Option(metavar="FILE", help="What VecNormalize.save wrote beside a .zip model."),
]
EnvOption = Annotated[
    str | None,
    Option(
        metavar="my.py:NAME",
        help="What wraps the environment that the policies play in: their own sensors or actions.",
    ),
]


def policies_of(
    texts: Iterable[str],
    trust_code: bool,
    frame: bool = False,
    normalize: Path | None = None,
    env: str | None = None,
) -> list[PolicySpec]:
    """Return the policies that `--policy` and the options of policies describe.

    Raises:
        SetupError: `--frame` or `--normalize`, but no model that it could be for.
    """
    policies = [PolicySpec.of(text).replace(trusted=trust_code) for text in texts]
    of_all: dict[str, JsonValue] = {} if env is None else {"env": env}
    of_models: dict[str, JsonValue] = {"frame": True} if frame else {}
    if normalize is not None:
        of_models["normalize"] = str(normalize)
    if of_models and not any(map(_is_model, policies)):
        raise SetupError(
            f"--{next(iter(of_models))}: is for a model of stable-baselines3, a {SB3_SUFFIX} file"
        )
    return [
        policy.replace(parameters=of_all | of_models if _is_model(policy) else of_all)
        for policy in policies
    ]


def _is_model(policy: PolicySpec) -> bool:
    return policy.name.endswith(SB3_SUFFIX)
