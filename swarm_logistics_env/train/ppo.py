"""`python train/ppo.py --preset delivery`: `swarm-logistics train delivery`, from the clone."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def main() -> int:
    """Train what the command line asks for; returns the exit code."""
    # Python looks for modules in the folder of a script; the package is in the clone above it.
    sys.path[0] = str(Path(__file__).resolve().parents[2])
    from swarm_logistics_env.errors import SwarmLogisticsError
    from swarm_logistics_env.train.request import train_as_asked
    from swarm_logistics_env.train.training import preset_names

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", required=True, help=f"{', '.join(preset_names())}, or a file")
    parser.add_argument("--out", type=Path, help="directory of the training")
    parser.add_argument("--seed", type=int, help="of everything random")
    parser.add_argument("--steps", type=int, help="agent-steps to learn from")
    parser.add_argument("--device", choices=["cpu", "cuda"], help="the GPU where there is one")
    asked = parser.parse_args()
    try:
        path = train_as_asked(asked.preset, asked.out, asked.seed, asked.steps, asked.device)
    except SwarmLogisticsError as error:
        sys.stderr.write(f"train/ppo.py: {error}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("\nstopped; the same command goes on\n")
        return 130
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
