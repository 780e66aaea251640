"""The command line, `swarm-logistics`. Commands import what they use when they run."""

from swarm_logistics_env.cli.app import app

__all__ = ["app"]
