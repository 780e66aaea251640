"""Checks to run on an environment with wrappers or a policy of one's own.

Each check takes `make`, a function that returns a new parallel environment. It plays one episode
and raises its own subclass of AssertionError, with a sentence about the first thing that is wrong.

Example:
    >>> import functools
    >>> from swarm_logistics_env import swarm_logistics_v0, testing
    >>> make = functools.partial(swarm_logistics_v0.parallel_env, n_robots=3)
    >>> testing.check_spaces(make, steps=20)
"""

from swarm_logistics_env.testing.determinism import check_determinism
from swarm_logistics_env.testing.playing import (
    ConformanceError,
    ConservationError,
    DeterminismError,
    FaultsError,
    OverlapError,
    SpaceError,
)
from swarm_logistics_env.testing.space_check import check_spaces
from swarm_logistics_env.testing.world_checks import (
    check_conservation,
    check_faults,
    check_overlap,
)

__all__ = [
    "ConformanceError",
    "ConservationError",
    "DeterminismError",
    "FaultsError",
    "OverlapError",
    "SpaceError",
    "check_conservation",
    "check_determinism",
    "check_faults",
    "check_overlap",
    "check_spaces",
]
