from __future__ import annotations

import pytest

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparison import OTHER_BEHAVIOUR, Comparison
from swarm_logistics_env.studies.presets import PAPER, PRESETS


def test_quick_asks_every_indicator_at_four_seeds_and_every_preset_can_be_planned() -> None:
    assert all(Study.preset(name).plan().comparisons for name in PRESETS)
    plan = Study.preset("quick").plan()
    assert {c.indicator for c in plan.comparisons} == {"S", "FT", "R", "A", "change"}
    # N = 10, N = 25, removed, FM4, delivery width 1, random walk; restocked: none, its twin,
    # removed, FM4.
    assert len(plan.cases) == 10
    assert len(plan.seeds) == 4


def test_resilience_has_both_references_and_a_null() -> None:
    plan = Study.preset("resilience").plan()
    # No fault, its twin, and m = 1, 2, 3 of the removed and of three modes.
    assert len(plan.cases) == 2 + 3 * 4
    (null,) = plan.nulls.values()
    assert null.setting == OTHER_BEHAVIOUR
    for comparison in plan.comparisons:
        assert comparison.original.case.scenario == null.case.scenario
        (fault,) = comparison.changed.case.faults
        assert fault.onset == pytest.approx(comparison.changed.case.scenario.duration / 3, 0.1)
        assert comparison.changed.case.scenario.restock
        if comparison.removed:
            assert comparison.removed.case.faults[0].onset == fault.onset


# The specification of the statistics prints these to three decimals.
GOLDEN = {
    "S": [1.000, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135],
    "FT": [0.051, 0.077, -0.026, 0.026, 0.154, -0.026, 0.026, 0.154, 0.103, 0.0, -0.513, -0.615],
    "R": [0.091, 0.054, 0.017, 0.066, 0.131, 0.017, 0.066, 0.131, 0.146, 0.040, -0.535, -0.572],
    "A": [0.872, 0.723, 0.723, 0.610, 0.268, 0.187, -0.773],
}

COMPARISONS = Study.preset("paper").plan().comparisons


def published(comparison: Comparison) -> float:
    estimate = PAPER.estimate(comparison)
    assert estimate is not None
    return estimate.value


@pytest.mark.parametrize("indicator", GOLDEN)
def test_published_tables_give_the_golden_values(indicator: str) -> None:
    values = [
        published(comparison)
        for comparison in COMPARISONS
        if comparison.indicator == indicator and comparison.threshold == 0
    ]
    assert values == pytest.approx(GOLDEN[indicator], abs=5e-4)


def test_every_claim_follows_from_the_published_tables() -> None:
    claims = {
        comparison: PAPER.claims[comparison.question]
        for comparison in COMPARISONS
        if comparison.indicator != "change"
    }
    assert len(claims) == len(PAPER.claims) == 41
    for comparison, claim in claims.items():
        assert (published(comparison) > comparison.threshold) == claim, comparison.label


def test_33_cells() -> None:
    assert len(PAPER.cells) == 9 + 4 + 12 + 4 + 3 + 1
    planned = {arm.setting for comparison in COMPARISONS for arm in comparison.arms}
    assert set(PAPER.cells) <= planned


def test_one_set_of_defaults_for_all_tables() -> None:
    """All but the factor itself and Table I's number of items is the base scenario."""
    plan = Study.preset("paper").plan()
    base = plan.specification.scenario
    for _, table, arm in plan.cells:
        ours, theirs = arm.case.scenario.model_dump(), base.model_dump()
        varied = {name for name in ours if ours[name] != theirs[name]}
        allowed = {arm.setting.name} if arm.setting.kind in {"size", "parameter"} else set()
        if table.startswith("Table I:") or arm.setting.value == 100:
            allowed |= {"n_items", "n_robots"}
        assert varied <= allowed
