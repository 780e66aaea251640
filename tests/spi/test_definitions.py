"""The table of indicators, and what importing them costs and needs."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change
from swarm_logistics_env.studies import Study


def test_each_row_calls_its_function_with_the_paper_s_numbers() -> None:
    p_o, p_new, p_s = np.full(4, 20.0), np.full(4, 30.0), np.full(4, 10.0)
    values = {
        symbol: row.function(
            **dict(zip(row.performances, (p_o, p_new, p_s))),
            **row.arguments(Change(10.0, 20.0 if row.compares != "fault" else 2.0, 10)),
        ).value
        for symbol, row in DEFINITIONS.items()
    }
    assert values == pytest.approx({"S": 0.5, "FT": 1.0, "R": 0.7, "A": 1.5, "change": 0.5})


def test_references_are_those_that_the_paper_names() -> None:
    assert DEFINITIONS["FT"].references == ("P_o", "P_S")
    assert DEFINITIONS["S"].references == ("P_N",)


def test_an_indicator_that_no_row_defines_is_refused(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match="no indicator 'FR'"):
        Study(**small, indicators=["FR"])


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
        if name != "Verdict":
            assert getattr(spi, name).__doc__, name


def test_a_removed_name_says_what_to_use_instead() -> None:
    with pytest.raises(ImportError, match=r"removed in 0\.3\.0: use spi\.repair_times"):
        from swarm_logistics_env.spi import self_repair  # type: ignore[attr-defined]  # noqa: F401
