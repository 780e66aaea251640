"""Parameters of a scripted policy that a search found, as a JSON file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from swarm_logistics_env.errors import PolicyError, SwarmLogisticsError
from swarm_logistics_env.policies.card import Score
from swarm_logistics_env.records import Record

SUFFIX = ".json"


class TunedPolicy(Record):
    """A scripted policy with the parameters that a search found.

    Args:
        format: the version of the file's format.
        policy: name of the scripted policy.
        parameters: the parameters that were searched.
        command: the command line of the search.
        versions: the versions of the packages that searched.
        search: the settings of the search.
        scores: its scores, measured afterwards on other seeds than the search's.
    """

    error_type: ClassVar[type[SwarmLogisticsError]] = PolicyError

    format: Literal["tuned policy 1"] = "tuned policy 1"
    policy: str
    parameters: dict[str, float]
    command: str = ""
    versions: dict[str, str] = Field(default_factory=dict)
    search: dict[str, Any] = Field(default_factory=dict)
    scores: tuple[Score, ...] = ()


def read_tuned(path: Path) -> TunedPolicy:
    """Return what such a file holds.

    Raises:
        PolicyError: it cannot be read, or is something else.
    """
    try:
        return TunedPolicy.from_json(path.read_bytes())
    except OSError as error:
        raise PolicyError(f"cannot read the policy file {path}: {error.strerror}") from error
    except PolicyError as error:
        raise PolicyError(f"{path} holds no tuned policy: {error}") from None
