"""`python train/ppo.py --preset delivery`: `swarm-logistics train delivery`, from the clone."""

from __future__ import annotations

import sys
from pathlib import Path


def main() -> int:
    """Train what the command line asks for; returns the exit code."""
    # Python looks for modules in the folder of a script; the package is in the clone above it.
    sys.path[0] = str(Path(__file__).resolve().parents[2])
    from swarm_logistics_env.cli import app

    return app.run(["train", *(word for word in sys.argv[1:] if word != "--preset")])


if __name__ == "__main__":
    sys.exit(main())
