"""The policies that a command line means."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

from pydantic import JsonValue
from typer import Option

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.sb3_files import SB3_SUFFIX

FrameOption = Annotated[
    bool, Option("--frame", help="A .zip model learned through MotionFrame, so it plays in one.")
]
NormalizeOption = Annotated[
    Path | None,
    Option(metavar="FILE", help="What VecNormalize.save wrote beside a .zip model."),
]


def policies_of(
    texts: Iterable[str], trust_code: bool, frame: bool = False, normalize: Path | None = None
) -> list[PolicySpec]:
    """Return the policies that `--policy`, `--trust-code`, `--frame` and `--normalize` describe.

    Raises:
        SetupError: the last two are given, but no model that they could be for.
    """
    policies = [PolicySpec.of(text).replace(trusted=trust_code) for text in texts]
    options: dict[str, JsonValue] = {"frame": True} if frame else {}
    if normalize is not None:
        options["normalize"] = str(normalize)
    if options and not any(policy.name.endswith(SB3_SUFFIX) for policy in policies):
        raise SetupError(
            f"--{next(iter(options))}: is for a model of stable-baselines3, a {SB3_SUFFIX} file"
        )
    return [
        policy.replace(parameters=options) if policy.name.endswith(SB3_SUFFIX) else policy
        for policy in policies
    ]
