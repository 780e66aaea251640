"""Version of the code that decides what a run gives: when it changes, stored runs are stale."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from importlib.metadata import packages_distributions, version
from pathlib import Path
from typing import Any

from swarm_logistics_env.episode import Play
from swarm_logistics_env.policies.policy import code_digest, function_digest, without_prose
from swarm_logistics_env.warehouse import Warehouse

# These files decide what a run in somebody else's environment gives.
ENVIRONMENT_SOURCES = (
    "streams.py",
    "tasks/failing_robots.py",
    "tasks/parallel_policies.py",
    "tasks/parallel_task.py",
    "tasks/performance.py",
    "tasks/tuple_env.py",
)
_environments: dict[str, str] = {}


def code_version() -> str:
    """Return the digest of the code that decides an episode, 16 hexadecimal digits.

    Its modules are those that the warehouse and `run_episode` use; policies have identities of
    their own. Docstrings, comments on lines of their own and blank lines do not count.
    """
    return code_digest(Play, Warehouse)


def environment_version(settings: str, functions: Iterable[object], make: Callable[[], Any]) -> str:
    """Return a digest of what decides a run in a parallel environment, and its libraries' versions.

    Args:
        settings: of the task; one process answers once for the same settings.
        functions: of the task, whose modules count.
        make: makes the environment, whose classes tell which libraries it comes from.
    """
    if settings not in _environments:
        package = Path(__file__).parents[1]
        digest = hashlib.sha256(settings.encode())
        for name in ENVIRONMENT_SOURCES:
            digest.update(without_prose((package / name).read_text(encoding="utf-8")).encode())
        for function in functions:
            digest.update(function_digest(function).encode())
        env = make()
        try:
            modules = {kind.__module__.partition(".")[0] for kind in type(env.unwrapped).__mro__}
        finally:
            env.close()
        modules.discard(package.name)  # its own code is known by its sources
        installed = packages_distributions()
        names = sorted({name for module in modules for name in installed.get(module, ())})
        versions = ", ".join(f"{name} {version(name)}" for name in names)
        digest.update(versions.encode())
        _environments[settings] = f"{digest.hexdigest()[:16]} ({versions})"
    return _environments[settings]
