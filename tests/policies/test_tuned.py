from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import policies
from swarm_logistics_env.policies.loading import WEIGHTS
from swarm_logistics_env.policies.tuned import read_tuned


@pytest.mark.parametrize("path", sorted(WEIGHTS.glob("*.json")), ids=lambda path: path.stem)
def test_a_tuned_policy_is_its_scripted_one_with_other_parameters_and_better(path: Any) -> None:
    record = read_tuned(path)
    tuned: Any = policies.load(path.stem)
    own: Any = policies.load(record.policy)
    assert own.parameters.replace(**record.parameters) == tuned.parameters != own.parameters
    assert policies.identity(tuned) != policies.identity(own)
    assert record.command.startswith("swarm-logistics train --tune")
    (change,) = (score for score in record.scores if score.measure == "change")
    assert change.low is not None
    assert change.low > 0.0


def test_a_parameter_given_comes_before_the_tuned_one() -> None:
    tuned: Any = policies.load("swarm-dt-follow-tuned", taxis_gain=0.5)
    assert tuned.parameters.taxis_gain == 0.5
    assert tuned.parameters.heading_follows
