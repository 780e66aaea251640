"""Notes: what a store says of its study besides the runs."""

from __future__ import annotations

from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.store import Store

SPECIFICATION = "specification"  # JSON
CODE = "code"  # version
IDENTITIES = "identities"  # of policies, JSON
DECLARED_SEEDS = "declared_seeds"  # how many, at the first run
DECLARED_LOOKS = "declared_looks"  # JSON, at the first run
IMPORTED = "imported"  # where the runs came from; absent: they were run

_NEEDED = (SPECIFICATION, CODE, IDENTITIES, DECLARED_SEEDS)


def planned(store: Store, directory: Path) -> dict[str, str]:
    """Return the notes from which the plan of a stored study follows.

    Raises:
        StudyError: one is missing.
    """
    found = {name: store.note(name) for name in (*_NEEDED, DECLARED_LOOKS)}
    for name in _NEEDED:
        if found[name] is None:
            raise StudyError(
                f"the store in {directory} does not note its {name}: run the study once more "
                "there (finished runs are kept), then it will"
            )
    return {name: value for name, value in found.items() if value is not None}
