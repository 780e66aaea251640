"""The table of indicators: a new row appears in plan, tables, figures and sentences."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.definitions import DEFINITIONS, Change, Definition
from swarm_logistics_env.spi.estimate import Estimate, judge
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of


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


def kept(p_o: ArrayLike, p_f: ArrayLike, **asked: Any) -> Estimate:
    """The share of P that is left with faulty robots: a function that a stranger adds."""
    terms = {"p_f": (p_f, 1.0, 0.0), "p_o": (p_o, 0.0, 1.0)}
    return judge("K", terms, offset=0.0, **asked)


def test_a_new_row_reaches_the_report(
    small: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = Definition(
        symbol="K",
        heading="performance kept K",
        compares="fault",
        performances={"p_o": "P_o", "p_f": "P_F"},
        function=kept,
        arguments=lambda _: {},
        adjectives={0.0: "alive"},
    )
    monkeypatch.setitem(DEFINITIONS, "K", row)
    study = Study(**small, indicators=["K"])
    study.run()
    (*_, test) = rows_of(study.findings().indicators)
    p_f, p_o = (
        [o.delivered for o in study.findings().outcomes_of(arm) or ()]
        for arm in (test.compared.changed, test.compared.original)
    )
    assert test.estimate is not None
    assert test.estimate.value == pytest.approx(sum(p_f) / sum(p_o))
    study.report(tmp_path)
    text = (tmp_path / "report.md").read_text()
    assert "swarm-dt, alive? Failure mode FM4, m = 1 of N = 4." in text
    assert (
        "performance kept K per failure mode and number m of faulty robots; above 0 alive" in text
    )
    assert "K [95 %]" in text


def test_an_indicator_that_no_row_defines_is_refused(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match="no indicator 'FR'"):
        Study(**small, indicators=["FR"])
