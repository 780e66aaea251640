"""The oldest versions that pyproject.toml allows, as constraints for pip.

    python verification/lowest.py study render > constraints.txt

They cover the dependencies of the package and of the extras that are named.
"""

import re
import sys
import tomllib
from pathlib import Path

if __name__ == "__main__":
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    extras = [project["optional-dependencies"][name] for name in sys.argv[1:]]
    for requirement in sum(extras, project["dependencies"]):
        match = re.match(r"([A-Za-z0-9_-]+)[^;]*?>=\s*([0-9.]+)", requirement)
        if match is None:
            raise ValueError(f"{requirement}: should name its oldest version, as name>=1.0")
        print(f"{match[1]}=={match[2]}")
