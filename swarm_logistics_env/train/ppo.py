"""`python train/ppo.py --preset delivery`: `swarm-logistics train delivery`, from the clone."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def main() -> int:
    """Train what the command line asks for; returns the exit code."""
    # Python looks for modules in the folder of a script; the package is in the clone above it.
    sys.path[0] = str(Path(__file__).resolve().parents[2])
    from swarm_logistics_env.cli import app

    parser = argparse.ArgumentParser(
        description=__doc__, epilog="Other options are those of `swarm-logistics train`."
    )
    parser.add_argument("--preset", required=True, help="name of a preset, or a TOML file")
    asked, others = parser.parse_known_args()
    return app.run(["train", asked.preset, *others])


if __name__ == "__main__":
    sys.exit(main())
