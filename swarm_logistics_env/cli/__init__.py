"""The command line, `swarm-logistics`. Commands import what they use when they run."""

import gc

gc.disable()  # nothing that an import makes is garbage
from .app import app  # noqa: E402 - see above

gc.enable()

__all__ = ["app"]
