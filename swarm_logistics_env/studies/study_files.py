"""Specifications as they are read: from a study file in TOML, and from the JSON in a store."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from swarm_logistics_env.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.studies.specification import Specification
from swarm_logistics_env.tasks.policy_choice import policy_name, runs_code
from swarm_logistics_env.tasks.task import Task
from swarm_logistics_env.tasks.task_choice import DEFAULT, NAMES, refuse_untrusted


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
        trust_code: whether its task and its policies may be code ("package.module:Class", or a file
            of stable-baselines3), which runs when it is loaded.

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
    refuse_untrusted(fields.get("task"), path, trust_code=trust_code)
    try:
        specification = Specification(**{"name": path.stem, **fields})
    except SwarmLogisticsError as error:  # whichever record of it refuses
        raise StudyError(f"{path}: {error}") from error
    named = [*specification.policies, *(ablation.policy for ablation in specification.ablations)]
    for policy in filter(runs_code, named):
        if not trust_code:
            raise StudyError(
                f"{path}: policy {policy_name(policy)!r} is code, which runs when it is loaded: "
                "should be a policy's name, or be allowed by --trust-code (trust_code=True)"
            )
    return specification


def read_stored(
    text: str, place: Path, *, task: Task | None = None, trust_code: bool = False
) -> Specification:
    """Return the specification that a store in `place` holds as JSON.

    Args:
        task: the task that it names; None: it is found by that name.
        trust_code: whether it may be found by importing it, which runs its module.

    Raises:
        StudyError: it is damaged, or its task cannot be found.
    """
    fields = json.loads(text)
    named = fields.get("task", DEFAULT)
    if task is not None:
        fields["task"] = task
    elif ":" not in named and named not in NAMES:
        raise StudyError(
            f"{place}: was played on the task {named!r}, an object: should be handed over again, "
            "as Study.stored(.., task=..)"
        )
    else:
        refuse_untrusted(named, place, trust_code=trust_code)
    return Specification(**fields)
