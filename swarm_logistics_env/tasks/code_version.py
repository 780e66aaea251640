"""Version of the code that decides what a run gives: when it changes, stored runs are stale."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from functools import cache
from importlib.metadata import packages_distributions, version
from pathlib import Path
from typing import Any

from swarm_logistics_env.policies.code_identity import function_digest, without_prose

# Policies are not here, only what calls them: each policy has an identity of its own.
SOURCES = (
    "scenario.py",
    "streams.py",
    "kernels.py",
    "observations.py",
    "episode.py",
    "policies/policy.py",
    "warehouse",
)
# These files share out the worlds of a vector environment; a run is one world.
LEFT_OUT = ("warehouse/thread_pool.py", "warehouse/atomic.py")
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


@cache
def code_version() -> str:
    """Return the digest of the package's simulation, 16 hexadecimal digits.

    Docstrings, comments on lines of their own and blank lines do not count.
    """
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for name in SOURCES:
        source = package / name
        for file in sorted(source.rglob("*.py")) if source.is_dir() else [source]:
            path = file.relative_to(package).as_posix()
            if path in LEFT_OUT:
                continue
            digest.update(path.encode() + b"\0")
            digest.update(without_prose(file.read_text(encoding="utf-8")).encode() + b"\0")
    return digest.hexdigest()[:16]


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
