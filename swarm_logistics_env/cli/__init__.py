"""The command line, `swarm-logistics`. Commands import what they use when they run."""

from .app import app

__all__ = ["app"]
