"""Looks declared before the first run: intervals and verdicts at O'Brien-Fleming levels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.report_files import markdown
from swarm_logistics_env.spi.estimate import verdict_at
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of

FIELDS: dict[str, Any] = {
    "scenario": {
        "n_items": 8,
        "warehouse_width": 3.0,
        "warehouse_height": 3.0,
        "delivery_width": 1.0,
        "duration": 20.0,
    },
    "sizes": [{"values": [2, 6]}],
}


def test_each_declared_look_is_taken_at_its_level(tmp_path: Path) -> None:
    looks = (3, 6)
    for seeds, alpha in zip(looks, spi.look_alphas(looks), strict=True):
        study = Study(out=tmp_path, seeds=seeds, looks=looks, **FIELDS)
        study.run()
        results = study.findings()
        assert not results.exploratory
        assert results.confidence == pytest.approx(1 - alpha)
        (test,) = rows_of(results.indicators)
        assert test.estimate is not None
        assert test.estimate.confidence == results.confidence
        plain = spi.scalability(*results.performance["by_seed"], n=2, m=4, confidence=0.95)
        assert test.estimate.verdict == verdict_at(alpha, plain.p_value, plain.probability)
    assert results.confidence < 0.96


def test_first_look_of_very_many_has_a_level_below_1() -> None:
    # Its own share of the error is about 1e-56.
    study = Study(seeds=2, looks=(2, 100), **FIELDS)
    study.run()
    results = study.findings()
    assert not results.exploratory
    assert 0.9999 < results.confidence < 1.0
    (test,) = rows_of(results.indicators)
    assert test.estimate is not None
    assert test.estimate.verdict == "inconclusive"
    assert "> 99.99 % interval" in markdown(document(results))


def test_look_that_was_not_declared_is_exploratory(tmp_path: Path) -> None:
    Study(out=tmp_path, seeds=2, looks=(2, 4), **FIELDS).run()
    undeclared: list[dict[str, Any]] = [{"seeds": 3}, {"seeds": 3, "looks": (2, 3)}]
    for fields in undeclared:
        study = Study(out=tmp_path, **fields, **FIELDS)
        study.run()
        assert study.findings().exploratory
        assert study.findings().confidence == 0.95


def test_a_look_at_other_seeds_than_the_declared_ones_is_exploratory(tmp_path: Path) -> None:
    looks = (2, 3)
    Study(out=tmp_path, seeds=2, first_seed=1000, looks=looks, **FIELDS).run()
    assert not Study.stored(tmp_path).findings().exploratory
    other = Study(out=tmp_path, seeds=3, first_seed=0, looks=looks, **FIELDS)
    other.run()
    assert other.findings().exploratory


def test_looks_that_are_declared_late_change_nothing(tmp_path: Path) -> None:
    Study(out=tmp_path, seeds=2, **FIELDS).run()
    study = Study(out=tmp_path, seeds=3, looks=(3, 6), **FIELDS)
    study.run()
    assert study.findings().exploratory


def test_report_tells_the_declared_looks_and_their_levels(tmp_path: Path) -> None:
    study = Study(out=tmp_path, seeds=2, looks=(2, 4), **FIELDS)
    study.run()
    text = markdown(document(study.findings()))
    first, last = spi.look_alphas((2, 4))
    assert f"| 1 of 2 | 2 | {first:.4f} | {100 * (1 - first):.4g} % | this report |" in text
    assert f"| 2 of 2 | 4 | {last:.4f} | {100 * (1 - last):.4g} % | to come |" in text
    assert f"| P [95 %] | one run [95 %] | S [{100 * (1 - first):.4g} %]" in text
    assert "No look was declared" not in text
    other = Study(out=tmp_path, seeds=3, looks=(2, 3), **FIELDS)
    other.run()
    told = markdown(document(other.findings()))
    assert "No look was declared at 3 paired seeds (0 to 2): every verdict is exploratory." in told
