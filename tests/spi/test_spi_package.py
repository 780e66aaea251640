"""What importing the indicators costs and needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from swarm_logistics_env import spi


def test_importing_the_indicators_loads_nothing_heavy() -> None:
    code = (
        "import sys, swarm_logistics_env.spi;"
        "heavy = ('scipy.special', 'scipy.optimize', 'scipy.stats', 'pandas');"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there_and_documented() -> None:
    for name in spi.__all__:
        assert getattr(spi, name) is not None
        if name not in ("Spending", "Verdict"):
            assert getattr(spi, name).__doc__, name


def test_a_removed_name_says_what_to_use_instead() -> None:
    with pytest.raises(ImportError, match=r"removed in 0\.3\.0: use spi\.repair_times"):
        from swarm_logistics_env.spi import self_repair  # type: ignore[attr-defined]  # noqa: F401
