"""What importing the indicators costs and needs."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from swarm_logistics_env import spi

FILES = sorted(Path(spi.__file__).parent.glob("*.py"))


def test_importing_the_indicators_loads_nothing_heavy() -> None:
    code = (
        "import sys, swarm_logistics_env.spi;"
        "heavy = ('scipy.special', 'scipy.optimize', 'scipy.stats', 'pandas');"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_file_needs_numpy_scipy_and_its_siblings_only(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            roots = {(node.module or "").split(".")[0]} if node.level == 0 else set()
            assert node.level <= 1
        elif isinstance(node, ast.Import):
            roots = {name.name.split(".")[0] for name in node.names}
        else:
            continue
        assert roots <= set(sys.stdlib_module_names) | {"numpy", "scipy"}


def test_every_public_name_is_there_and_documented() -> None:
    for name in spi.__all__:
        assert getattr(spi, name) is not None
        if name not in ("Spending", "Verdict"):
            assert getattr(spi, name).__doc__, name


def test_a_removed_name_says_what_to_use_instead() -> None:
    with pytest.raises(ImportError, match=r"removed in 0\.3\.0: use spi\.repair_times"):
        from swarm_logistics_env.spi import self_repair  # type: ignore[attr-defined]  # noqa: F401
