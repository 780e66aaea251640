"""The oldest versions that pyproject.toml allows, as constraints for pip.

    python verification/lowest.py study render > constraints.txt

They cover the dependencies of the package and of the extras that are named.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path


def lowest(extras: list[str]) -> list[str]:
    """Return "name==oldest" for every dependency.

    Raises:
        ValueError: a dependency names no oldest version.
    """
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    asked = list(project["dependencies"])
    for extra in extras:
        asked += project["optional-dependencies"][extra]
    return [_oldest(requirement) for requirement in asked]


def _oldest(requirement: str) -> str:
    match = re.match(r"([A-Za-z0-9_-]+)[^;]*?>=\s*([0-9.]+)", requirement)
    if match is None:
        raise ValueError(f"{requirement}: should name its oldest version, as name>=1.0")
    return f"{match[1]}=={match[2]}"


if __name__ == "__main__":
    sys.stdout.write("\n".join(lowest(sys.argv[1:])) + "\n")
