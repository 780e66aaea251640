"""Runs that one watches in the browser and interferes with, and films of runs."""

from swarm_logistics_env.watch.session import Session

__all__ = ["Session"]
