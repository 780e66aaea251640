"""How often studies that run until they are clear are wrong, in worlds whose answer is known."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study.questions.specification import looks_up_to
from verification.generators import MODELS
from verification.verdict_errors import wrong_verdicts


@pytest.mark.unmeasured
@pytest.mark.parametrize("model", MODELS)
def test_wrong_verdicts_over_all_looks_are_bounded(model: str) -> None:
    # 1,000 studies tell 0.05 to 0.014; `python -m verification.verdict_errors` plays 2,000.
    wrong = wrong_verdicts(model, looks_up_to(100), studies=1_000)
    assert max(wrong.above, wrong.below) <= 0.035
    seen = wrong_verdicts(model, looks_up_to(100), studies=1_000, only_seen=True).share
    assert 0.02 < seen < 0.06
