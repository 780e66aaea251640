"""The command line, `swarm-logistics`. Commands import what they use when they run."""

import os

# Else numba would read in a file .numba_config.yaml of the current folder, which may be somebody
# else's, from where to load compiled code.
os.environ.setdefault("NUMBA_CACHE_DIR", "")
# A torch that a policy loads while it plays computes in one thread, as everywhere (`one_thread`).
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

from .app import app

__all__ = ["app"]
