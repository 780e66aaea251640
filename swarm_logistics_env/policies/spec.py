"""Policies by text: what a text stands for, its label, its identity, whether it is trusted."""

from __future__ import annotations

import functools
import inspect
import re
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self, cast

from pydantic import Field, JsonValue, field_validator, model_serializer

from swarm_logistics_env.core.code_files import file_of_name, import_callable
from swarm_logistics_env.core.errors import (
    RAISED_BY_OTHERS,
    PolicyError,
    SwarmLogisticsError,
    suggest,
)
from swarm_logistics_env.core.fingerprint import UNSTABLE, changed_files, changes, deep_copy
from swarm_logistics_env.core.records import Record, canonical_json
from swarm_logistics_env.policies.biased_walk import BiasedWalk, BiasedWalkCompass
from swarm_logistics_env.policies.c_files import is_c_name
from swarm_logistics_env.policies.central import Central
from swarm_logistics_env.policies.central_stock import CentralStock
from swarm_logistics_env.policies.files import (
    SUFFIX,
    maker_of_file,
    read_card,
    read_policy,
)
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.models import within
from swarm_logistics_env.policies.policy import Policy, check_policy, identity_parts
from swarm_logistics_env.policies.sb3_files import (
    SB3_SUFFIX,
    StableBaselinesModel,
    refuse_untrusted,
)
from swarm_logistics_env.policies.site_fidelity import SiteFidelity
from swarm_logistics_env.policies.swarm_dt import CONSTANTS_2026, CONSTANTS_TUNED, SwarmDT
from swarm_logistics_env.policies.told import Told

ENTRY_POINTS = "swarm_logistics_env.policies"
SUFFIXES = (SUFFIX, SB3_SUFFIX)  # of policy files
WEIGHTS = Path(__file__).parent / "weights"


SCRIPTED: dict[str, Callable[..., Policy]] = {
    "swarm-dt": SwarmDT,
    "swarm-dt-2026": functools.partial(SwarmDT, **CONSTANTS_2026),
    "swarm-dt-tuned": functools.partial(SwarmDT, **CONSTANTS_TUNED),
    "swarm-dt-follow": functools.partial(SwarmDT, heading_follows=True),
    # This is Swarm D-T without its taxis, for ablations.
    "random-walk": functools.partial(SwarmDT, taxis_gain=0.0),
    "biased-walk": BiasedWalk,
    "biased-walk-compass": BiasedWalkCompass,
    "site-fidelity": SiteFidelity,
    "homing": Homing,
    "homing-stock": HomingStock,
    "homing-told": Told,
    "central": Central,
    "central-stock": CentralStock,
}

# Each file names the command that made it.
TRAINED = {path.stem: path for path in sorted(WEIGHTS.glob(f"*{SUFFIX}"))}
NAMES: dict[str, Callable[..., Policy]] = {
    **SCRIPTED,
    **{name: functools.partial(read_policy, path) for name, path in TRAINED.items()},
}


def load(
    name: str, *, trust_code: bool = False, env: str | None = None, **parameters: Any
) -> Policy:
    """Return the policy called `name`.

    Args:
        name: one of `NAMES`, a name that an installed package declares in the entry-point group
            `swarm_logistics_env.policies`, "package.module:Class", "c:my.c" (see `c_files`), or the
            path of a policy file. Naming a class or a file in C executes it. A file that
            `swarm-logistics train` wrote (.safetensors) executes nothing; a model that
            stable-baselines3 saved (.zip) does.
        trust_code: whether to read a file although that executes the code in it.
        env: what wraps the environment that it plays in, as "my.py:wrap" (see `within`).
        parameters: handed to the policy, e.g. `taxis_gain=0.5` for "swarm-dt".

    Raises:
        PolicyError: there is no such policy, it does not take these parameters, or the name stands
            for several trainings.
    """
    if trainings := trainings_of(name):
        raise PolicyError(
            f"policy {name!r} is {len(trainings)} trainings: should name one of "
            f"{', '.join(trainings)}"
        )
    make = NAMES.get(name) or _entry_point_maker(name) or maker_of_file(name, trust_code)
    make = make or _import_maker(name)
    if make is None and name.endswith(".py"):
        raise PolicyError(f"policy {name!r}: should name its class, as '{name}:Class'")
    if make is None:
        names = [*NAMES, *entry_points(group=ENTRY_POINTS).names]
        hint = "; see examples/mixed_swarm.py" if "=" in name else suggest(name, names)
        kinds = "a name, 'my.py:Class', 'package.module:Class'"
        kinds += ", 'c:my.c', or a .safetensors or .zip file"
        raise PolicyError(f"no policy {name!r} ({kinds}){hint}")
    if env is not None and ":" not in env:
        raise PolicyError(f"env {env!r}: should be 'my.py:NAME' or 'package.module:NAME'")
    wrap = None if env is None else import_callable("env", env, PolicyError)
    try:
        if wrap is not None and name.endswith(SB3_SUFFIX):
            return make(wrap=wrap, **parameters)
        policy: Policy = make(**parameters)
        check_policy(policy)
        return policy if wrap is None else within(policy, wrap)
    except SwarmLogisticsError:
        raise
    except RAISED_BY_OTHERS as error:  # of code that is not ours
        kind = type(error).__name__
        raise PolicyError(f"policy {name!r} cannot be made: {kind}: {error}") from error


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
    made: Any = Field(default=None, exclude=True, repr=False)
    trusted: bool = Field(default=False, exclude=True, repr=False)

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


def known_policies() -> Iterator[tuple[str, str, str]]:
    """Yield name, kind and a sentence of each policy of the package, then of those installed."""
    for name, make in SCRIPTED.items():
        maker = make if isinstance(make, functools.partial) else functools.partial(make)
        about = (inspect.getdoc(maker.func) or "").partition("\n\n")[0].replace("\n", " ")
        parameters = "".join(f" {field} = {value}." for field, value in maker.keywords.items())
        yield name, "scripted", about + parameters
    for name, path in TRAINED.items():
        yield name, "trained", read_card(path).about
    for point in entry_points(group=ENTRY_POINTS):
        yield point.name, "installed", point.value


ALL = "@all"


def trainings_of(name: str) -> tuple[str, ...]:
    """Return the names of all trainings of one recipe: those of "ppo-robust@all", or of files.

    "ppo-robust@all" stands for "ppo-robust", "ppo-robust@1" and so on; "my/robust@all.safetensors"
    for the files my/robust@1.safetensors and so on. Empty: the name does not end in "@all".

    Raises:
        PolicyError: fewer than two trainings go by that name.
    """
    suffix = SUFFIX if name.endswith(SUFFIX) else ""
    if not name.endswith(f"{ALL}{suffix}"):
        return ()
    stem = name.removesuffix(f"{ALL}{suffix}")
    names: Iterable[str] = NAMES
    if suffix:
        names = [str(path) for path in Path(stem).parent.glob(f"*{SUFFIX}")]
    pattern = re.compile(rf"{re.escape(stem)}(@(\d+))?{re.escape(suffix)}")
    matches = [match for text in names if (match := pattern.fullmatch(text))]
    trainings = sorted((int(match[2] or -1), match[0]) for match in matches)
    if len(trainings) < 2:
        raise PolicyError(
            f"policy {name!r}: should stand for two trainings or more, as {stem}@1{suffix} and "
            f"{stem}@2{suffix}, found {len(trainings)}"
        )
    return tuple(training for _, training in trainings)


def display_name(name: str) -> str:
    """Return how reports call the policy `name`: a trained policy's file by its card's name."""
    if trainings := trainings_of(name):
        stem = Path(name).name.removesuffix(SUFFIX).removesuffix(ALL)
        return f"{stem}, {len(trainings)} trainings"
    if not name.endswith(SUFFIX) or name in NAMES:
        return name
    try:
        return read_card(Path(name)).name
    except PolicyError:  # whoever loads it will say what is wrong with the file
        return name


def _entry_point_maker(name: str) -> Callable[..., Policy] | None:
    for point in entry_points(group=ENTRY_POINTS, name=name):
        maker: Callable[..., Policy] = point.load()
        return maker
    return None


def _import_maker(name: str) -> Callable[..., Policy] | None:
    return import_callable("policy", name, PolicyError) if ":" in name else None
