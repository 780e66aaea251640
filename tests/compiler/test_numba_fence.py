"""Which way kernels are compiled, and that the plain one gives the same bits."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env.compiler import kernels
from swarm_logistics_env.compiler.numba_fence import (
    FIRST_TESTED,
    LAST_TESTED,
    QUIET,
    WAY,
    choose_way,
)

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("version", ["0.61.0", "0.68.1", "0.66.0rc1"])
def test_a_tested_version_of_numba_is_compiled_for_in_the_fast_way(version: str) -> None:
    assert choose_way(version, None) == "fast"
    assert choose_way(version, "plain") == "plain"


@pytest.mark.parametrize("version", ["0.60.2", "0.69.0", "1.0.0", "0.70.0dev0+12.gabc"])
def test_another_version_gets_the_plain_way_and_a_warning(
    version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.warns(UserWarning, match=r"tested with 0\.61 to 0\.68.*many times as long"):
        assert choose_way(version, None) == "plain"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert choose_way(version, "fast") == "fast"
        monkeypatch.setenv(QUIET, "1")
        assert choose_way(version, None) == "plain"


@pytest.mark.skipif(not (ROOT / "pyproject.toml").is_file(), reason="the package is installed")
def test_the_package_allows_the_versions_that_were_tested() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (numba,) = (name for name in project["dependencies"] if name.startswith("numba"))
    assert numba == f"numba>=0.{FIRST_TESTED[1]},<0.{LAST_TESTED[1] + 1}"


SCRIPT = """
from swarm_logistics_env.compiler import kernels, numba_fence
from swarm_logistics_env.world.warehouse.grid import blank_grid, fill
import numpy as np

assert numba_fence.IS_PLAIN
print([kernels.gaussian(np.uint64(7), count).hex() for count in range(5)])
grid = blank_grid(4.0, 3.0, 0.5, 6)
positions = np.random.default_rng(1).uniform(0.5, 2.5, (6, 2))
fill(grid, positions, np.ones(6, bool))
print([part.tolist() for part in grid if isinstance(part, np.ndarray)])
"""


@pytest.mark.daily
def test_plain_kernels_give_the_same_bits() -> None:
    from swarm_logistics_env.world.warehouse.grid import blank_grid, fill

    command = [sys.executable, "-c", SCRIPT]
    environment = {**os.environ, WAY: "plain"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    grid = blank_grid(4.0, 3.0, 0.5, 6)
    fill(grid, np.random.default_rng(1).uniform(0.5, 2.5, (6, 2)), np.ones(6, bool))
    assert done.stdout.splitlines() == [
        str([kernels.gaussian(np.uint64(7), count).hex() for count in range(5)]),
        str([part.tolist() for part in grid if isinstance(part, np.ndarray)]),
    ]
