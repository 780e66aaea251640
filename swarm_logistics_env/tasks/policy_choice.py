"""Policies as a specification names them: a name, a name with parameters, or an object."""

from __future__ import annotations

import copy
import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer

from swarm_logistics_env import policies
from swarm_logistics_env.errors import PolicyError, suggest
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.policies import PolicySpec as PolicyChoice
from swarm_logistics_env.policies.files import SB3_SUFFIX, StableBaselinesModel
from swarm_logistics_env.records import canonical_json

Known = Mapping[str, Callable[..., Policy]]
NONE: Known = MappingProxyType({})


def policy_name(source: object) -> str:
    """Return what `policies.load` is asked for; of an object, the name of its class."""
    return source.name if isinstance(source, PolicyChoice) else policy_label(source)


def runs_code(source: object) -> bool:
    """Return whether to load a policy by its name runs code that the name leads to."""
    source = PolicyChoice(name=source) if isinstance(source, str) else source
    return isinstance(source, PolicyChoice) and source.runs_code


def policy_label(source: object) -> str:
    """Return how a study calls a policy: its label, the name it was asked for, or its class's."""
    if isinstance(source, PolicyChoice):
        return source.title
    return source if isinstance(source, str) else type(source).__name__


def told_apart(sources: Sequence[object]) -> tuple[object, ...]:
    """Return policies of which files with the same name on their cards are called by their paths.

    Raises:
        ValueError: two have the same label all the same.
    """
    counts = Counter(policy_label(source) for source in sources)
    found = tuple(
        source.replace(label=source.name)
        if isinstance(source, PolicyChoice)
        and counts[source.label] > 1
        and source.label == policies.called(source.name)
        else source
        for source in sources
    )
    for label, count in Counter(policy_label(source) for source in found).items():
        if count > 1:
            raise ValueError(f"policy {label!r} is given twice")
    return found


def policy_of(source: object, known: Known = NONE) -> Policy:
    """Return a policy that no run has used: an object is copied, a name loaded.

    Args:
        known: what makes the policies that the task knows by name; none for the warehouse, to which
            `policies.load` belongs.

    Raises:
        PolicyError: it cannot be found or built.
    """
    if isinstance(source, str | PolicyChoice):
        name, parameters = policy_name(source), getattr(source, "parameters", {})
        if name in known:
            return _made(known[name], name, parameters)
        if known and name.endswith(SB3_SUFFIX):
            return copy.deepcopy(_model(name))
        if known and name in policies.NAMES:
            raise PolicyError(f"the task has no policy {name!r}{suggest(name, known)}")
        return copy.deepcopy(_loaded(name, canonical_json(parameters)))
    if not (known or isinstance(source, Policy)):
        raise PolicyError(f"policy {source!r}: should have the methods reset and act")
    policy: Any = copy.deepcopy(source)
    made: Policy = policy
    return made


def policy_identity(source: object, known: Known = NONE) -> str:
    """Return text that changes whenever the policy's behaviour may have changed."""
    policy = policy_of(source, known)
    if isinstance(source, PolicyChoice):
        return source.identity_of(policy)
    return policies.identity(policy)


def _chosen(value: object) -> object:
    if isinstance(value, dict):
        value = PolicyChoice(**value)
    if isinstance(value, PolicyChoice) and not (value.parameters or value.label):
        value = value.name
    if isinstance(value, str) and (card_name := policies.called(value)) != value:
        return PolicyChoice(name=value, label=card_name)
    if isinstance(value, str | PolicyChoice) or hasattr(value, "act"):
        return value
    raise ValueError(
        "should be a policy's name, its path, a table of name and parameters, or an object with act"
    )


def _written(source: object) -> object:
    if isinstance(source, PolicyChoice):
        return source.model_dump(mode="json")
    return policy_label(source)


PolicySource = Annotated[Any, BeforeValidator(_chosen), PlainSerializer(_written)]


def _made(make: Callable[..., Policy], name: str, parameters: dict[str, Any]) -> Policy:
    try:
        return make(**parameters)
    except TypeError as error:
        raise PolicyError(f"policy {name!r} cannot be made: {error}") from None


@lru_cache(maxsize=8)
def _model(name: str) -> Policy:
    return StableBaselinesModel(Path(name))


@lru_cache(maxsize=8)
def _loaded(name: str, parameters: str) -> Policy:
    return policies.load(name, **json.loads(parameters))
