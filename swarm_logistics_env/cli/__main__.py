"""`python -m swarm_logistics_env.cli` is the command `swarm-logistics`."""

from swarm_logistics_env.cli import app

if __name__ == "__main__":
    app()
