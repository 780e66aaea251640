"""The command line, `swarm-logistics`. Commands import what they use when they run."""

import os

# Else numba would read in a file .numba_config.yaml of the current folder, which may be somebody
# else's, from where to load compiled code.
os.environ.setdefault("NUMBA_CACHE_DIR", "")

from .app import app

__all__ = ["app"]
