"""Version of the code that decides what a run gives: when it changes, stored runs are stale."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from swarm_logistics_env.policies.code_identity import without_prose

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
