"""The command line, `swarm-logistics`. Commands import what they use when they run."""

from swarm_logistics_env.cli import film_command, watch  # noqa: F401 - they add their commands
from swarm_logistics_env.cli.app import app

__all__ = ["app"]
