"""The policies that have names, and what a text stands for that somebody gives as one."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from swarm_logistics_env.core.code_files import import_callable
from swarm_logistics_env.core.errors import (
    RAISED_BY_OTHERS,
    PolicyError,
    SwarmLogisticsError,
    suggest,
)
from swarm_logistics_env.policies.biased_walk import BiasedWalk, BiasedWalkCompass
from swarm_logistics_env.policies.central import Central
from swarm_logistics_env.policies.central_stock import CentralStock
from swarm_logistics_env.policies.charging_robots import SUFFIX as CHARGING
from swarm_logistics_env.policies.charging_robots import charging
from swarm_logistics_env.policies.files import (
    SUFFIX,
    maker_of_file,
    read_card,
    read_policy,
)
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.models import within
from swarm_logistics_env.policies.policy import Policy, check_policy
from swarm_logistics_env.policies.sb3_files import SB3_SUFFIX
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
            stable-baselines3 saved (.zip) does. With "+charging" behind any of these, its robots go
            to charge, see `charging`.
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
    if name.endswith(CHARGING):
        inner = load(name.removesuffix(CHARGING), trust_code=trust_code, env=env, **parameters)
        return charging(inner)
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
