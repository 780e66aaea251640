"""The table of indicators: a new row appears in plan, tables, figures and sentences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

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
