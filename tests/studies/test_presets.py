from __future__ import annotations

import pytest

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparisons import OTHER_BEHAVIOUR
from swarm_logistics_env.studies.presets import presets


@pytest.mark.parametrize("name", list(presets()))
def test_every_preset_can_be_planned(name: str) -> None:
    assert Study.preset(name).plan().comparisons


def test_quick_asks_every_indicator_at_four_seeds() -> None:
    plan = Study.preset("quick").plan()
    assert {c.indicator for c in plan.comparisons} == {"S", "FT", "R", "A", "change"}
    # N = 10, N = 25, removed, FM4, delivery width 1, random walk; restocked: none, its twin,
    # removed, FM4.
    assert len(plan.conditions) == 10
    assert len(plan.seeds) == 4


def test_resilience_has_both_references_and_a_null() -> None:
    plan = Study.preset("resilience").plan()
    # No fault, its twin, and m = 1, 2, 3 of the removed and of three modes.
    assert len(plan.conditions) == 2 + 3 * 4
    (null_pair,) = plan.null_pairs
    assert null_pair.other.setting == OTHER_BEHAVIOUR
    assert null_pair.other.condition.scenario == null_pair.original.condition.scenario
    for comparison in plan.comparisons:
        assert comparison.original == null_pair.original
        (fault,) = comparison.changed.condition.faults
        assert fault.onset == pytest.approx(comparison.changed.condition.scenario.duration / 3, 0.1)
        assert comparison.changed.condition.scenario.restock
        if comparison.removed:
            assert comparison.removed.condition.faults[0].onset == fault.onset
