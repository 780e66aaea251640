"""A policy by its text, or one made in Python: its label, its identity, its trust, its loading."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, cast

from pydantic import Field, JsonValue, field_validator, model_serializer

from swarm_logistics_env.core.code_files import file_of_name
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, PolicyError, suggest
from swarm_logistics_env.core.fingerprint import UNSTABLE, changed_files, changes, deep_copy
from swarm_logistics_env.core.records import Record, canonical_json
from swarm_logistics_env.policies.c_files import is_c_name
from swarm_logistics_env.policies.catalogue import NAMES, display_name, load, trainings_of
from swarm_logistics_env.policies.policy import Policy, check_policy, identity_parts
from swarm_logistics_env.policies.sb3_files import (
    SB3_SUFFIX,
    StableBaselinesModel,
    refuse_untrusted,
)

# A task's own policies need not be the warehouse's `Policy`.
Makers = Mapping[str, Callable[..., Any]]
NO_MAKERS: Makers = MappingProxyType({})


class PolicySpec(Record):
    """A policy by its text, or one made in Python: its label, its identity, its trust, its loading.

    Args:
        name: the text, for `load`; of an object, the name of its class.
        parameters: handed to the policy; whatever TOML and JSON both hold.
        label: how a report calls it; empty: made from name and parameters.
        made: an object with `act`, where there is no text that makes it.
        trusted: whether a file may be read that executes the code in it; no file can say so.
    """

    error_type = PolicyError

    name: str
    parameters: dict[str, JsonValue] = Field(default_factory=dict)
    label: str = ""
    made: Any = Field(default=None, repr=False)
    trusted: bool = Field(default=False, repr=False)

    @classmethod
    def of(cls, value: object) -> Self:
        """Return the policy that a text, a table of fields or an object with `act` stands for.

        Raises:
            ValueError: it is none of these, or a field of the table cannot be.
        """
        if isinstance(value, cls):
            return value
        if isinstance(value, dict):
            for name in {"made", "trusted"}.intersection(value):  # not for a file to say
                raise ValueError(f"{name!r} is no field of a table")
            return cls(**value)
        if isinstance(value, str):
            card_name = display_name(value)
            return cls(name=value, label="" if card_name == value else card_name)
        if isinstance(value, type):
            raise ValueError(
                f"is the class {value.__name__}: should be an object, as {value.__name__}()"
            )
        if not hasattr(value, "act"):
            raise ValueError(
                "should be a policy's name, its path, a table of name and parameters, or an object "
                "with act"
            )
        return cls(name=type(value).__name__, made=value)

    def __hash__(self) -> int:
        return hash((self.name, self.label, id(self.made)))

    @field_validator("parameters")
    @classmethod
    def _refuse_reserved_names(cls, parameters: dict[str, JsonValue]) -> dict[str, JsonValue]:
        # These are `load`'s: whether to trust code is not for a file to say.
        for name in ("name", "trust_code", "trusted"):
            if name in parameters:
                raise ValueError(f"{name!r} is no parameter of a policy")
        return parameters

    @model_serializer
    def _serialize(self) -> str | dict[str, JsonValue]:
        if not (self.parameters or self.label):
            return self.name
        return {"name": self.name, "parameters": self.parameters, "label": self.label}

    @property
    def title(self) -> str:
        """What people call it: its label, or its name with the parameters given."""
        if self.label:
            return self.label
        parameters = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        name = display_name(self.name)
        return f"{name} ({parameters})" if parameters else name

    @property
    def trainings(self) -> tuple[Self, ...]:
        """The trainings that its name stands for, see `trainings_of`; empty: it is one policy."""
        return tuple(map(self.training, trainings_of(self.name)))

    def training(self, name: str) -> Self:
        """Return the training of that name."""
        return type(self)(name=name, parameters=self.parameters, trusted=self.trusted)

    @property
    def is_text(self) -> bool:
        """Whether a command line can name it: no object, of which a store keeps its class alone."""
        is_class = self.name.isidentifier() and self.name not in NAMES
        return self.made is None and not (self.parameters or is_class or self.trainings)

    @property
    def runs_code(self) -> bool:
        """Whether to load it runs code that its name leads to, so that somebody has to trust it."""
        names_code = ":" in self.name or self.name.endswith(SB3_SUFFIX)
        return self.made is None and (names_code or "env" in self.parameters)

    def load(self, makers: Makers = NO_MAKERS, planned: str | None = None) -> Policy:
        """Return the policy as no run has used it: an object is copied, a file read once a plan.

        Args:
            makers: what makes the policies that a task knows by name; none for the warehouse, to
                which `NAMES` belong.
            planned: the identity that it had when its runs were planned; None: whatever it is.

        Raises:
            PolicyError: it cannot be found or built, or is not what was planned.
        """
        if self.made is None and self.name in makers:
            return self._make(makers)
        policy = self._make(makers) if planned is None else self._make_planned(makers, planned)
        try:
            return cast("Policy", deep_copy(policy))
        except RAISED_BY_OTHERS as error:  # of code that is not ours
            raise PolicyError(
                f"policy {self.name!r} cannot be copied ({type(error).__name__}): should keep "
                "arrays, not an environment, as each run gets a copy"
            ) from error

    def _make_planned(self, makers: Makers, planned: str) -> Policy:
        if self.made is not None:
            # Its class may have come to this process by its content; files of it are read here.
            if files := changed_files(planned, _as_text(self._parts_of(self.made))):
                raise self._change_error(f"{', '.join(files)} changed")
            return self._make(makers)
        key = (self.name, canonical_json(self.parameters), planned)
        if key not in _planned_policies:
            _planned_policies[key] = self.refuse_other(planned, makers)
        return _planned_policies[key]

    def refuse_other(self, planned: str, makers: Makers = NO_MAKERS) -> Policy:
        """Return the policy as it is made now, which has to be the one that was planned.

        Raises:
            PolicyError: it cannot be found or built, or has another identity than `planned`.
        """
        policy = self._make(makers)
        if change := changes(planned, _as_text(self._parts_of(policy))):
            raise self._change_error(change)
        return policy

    def _change_error(self, change: str) -> PolicyError:
        return PolicyError(
            f"policy {self.title!r} is not what was planned: {change}; start the study anew"
        )

    def _make(self, makers: Makers) -> Policy:
        """Return the policy as its text or its maker says now."""
        if self.made is not None:
            if not makers:
                check_policy(self.made)
            policy: Policy = self.made
            return policy
        if self.name in makers:
            try:
                policy = makers[self.name](**self.parameters)
            except TypeError as error:
                raise PolicyError(f"policy {self.name!r} cannot be made: {error}") from None
            return policy
        if makers and self.name in NAMES:
            raise PolicyError(f"the task has no policy {self.name!r}{suggest(self.name, makers)}")
        if makers and self.name.endswith(SB3_SUFFIX):
            refuse_untrusted(Path(self.name), self.trusted)
            return StableBaselinesModel(Path(self.name))
        return load(self.name, trust_code=self.trusted, **cast("dict[str, Any]", self.parameters))

    def identity(self, makers: Makers = NO_MAKERS) -> str:
        """Return text that changes whenever the policy's behaviour may have; `makers` as `load`.

        Of several trainings it is a JSON list of their names and identities.
        """
        if self.trainings:
            identities = [(spec.name, spec.identity(makers)) for spec in self.trainings]
            return canonical_json(identities)
        parts = self._parts_of(self._make(makers))
        if parts != (again := self._parts_of(self._make(makers))):
            # What is another one each time cannot be compared with what was played before.
            return canonical_json(again | {"value": UNSTABLE + uuid.uuid4().hex})
        return _as_text(parts)

    def _parts_of(self, policy: Policy) -> dict[str, Any]:
        """Return what identifies the policy that it stands for, by name."""
        is_python = self.made is None and not is_c_name(self.name)
        file = file_of_name(self.name) if is_python else None
        parts = identity_parts(policy, [file] if file else ())
        # Two functions may make objects of one class; a class need not keep its parameters.
        if is_python and ":" in self.name:
            parts["made by"] = self.name.rpartition(":")[2]
        if self.parameters and "parameters" not in parts:
            parts["given"] = self.parameters
        return parts


def _as_text(parts: dict[str, Any]) -> str:
    """Return the identity with these parts."""
    if parts.keys() != {"identity"}:
        return canonical_json(parts)
    # A lone half of a sign cannot be written into a file.
    return str(parts["identity"]).encode(errors="backslashreplace").decode()


# By text, parameters and identity: policies that are what was planned, whatever changes later.
_planned_policies: dict[tuple[str, str, str], Policy] = {}
