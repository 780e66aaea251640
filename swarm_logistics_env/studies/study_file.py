"""Study files: a specification as TOML, the same fields under the same names."""

from __future__ import annotations

import tomllib
from pathlib import Path

from swarm_logistics_env.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.studies.policy_choice import policy_name
from swarm_logistics_env.studies.specification import Specification


def read_study_file(path: Path, *, trust_code: bool = False) -> Specification:
    """Return the specification in a TOML file, named after the file where it has no name.

    Example of a file:
        policies = ["swarm-dt", { name = "swarm-dt", parameters = { taxis_gain = 0.5 } }]
        seeds = 20
        scenario = { preset = "paper", duration = 300 }

        [[faults]]
        modes = ["FM1", "FM4"]
        robots = [1, 2]

        [[parameters]]
        name = "delivery_width"
        values = [2.0, 1.0]

    Args:
        trust_code: whether its policies may be classes ("package.module:Class"), whose modules run
            when they are loaded.

    Raises:
        StudyError: the file cannot be read, is not TOML, names code that it may not, or a field of
            it is unknown or cannot be.
    """
    try:
        fields = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StudyError(f"cannot read the study file {path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = str(error).splitlines()[0]
        raise StudyError(f"the study file {path} is not TOML: {reason}") from error
    except RecursionError:
        raise StudyError(f"the study file {path} is nested too deep") from None
    try:
        specification = Specification(**{"name": path.stem, **fields})
    except SwarmLogisticsError as error:  # whichever record of it refuses
        raise StudyError(f"{path}: {error}") from error
    named = [*specification.policies, *(ablation.policy for ablation in specification.ablations)]
    for policy in map(policy_name, named):
        if ":" in policy and not trust_code:
            raise StudyError(
                f"{path}: policy {policy!r} is a class, and to load it runs code: should be a "
                "policy's name, or be allowed by --trust-code (trust_code=True)"
            )
    return specification
