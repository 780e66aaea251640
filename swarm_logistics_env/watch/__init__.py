"""A run that one watches and interferes with, in a window or in the browser; and films of runs."""

from swarm_logistics_env.watch.session import Session

__all__ = ["Session"]
