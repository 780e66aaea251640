"""How much of the way to central control a policy goes."""

import numpy as np
import pytest

from research.play_knowing import share_of_way


def test_a_policy_in_the_middle_goes_half_of_the_way_and_the_interval_says_how_surely() -> None:
    rng = np.random.default_rng(1)
    world = rng.normal(0.0, 4.0, 40)
    least = 60.0 + world
    most = 100.0 + world + rng.normal(0.0, 1.0, 40)
    middle = 80.0 + world + rng.normal(0.0, 4.0, 40)
    share = share_of_way(middle, least, most)
    assert share.low is not None
    assert share.high is not None
    assert share.low < 0.5 < share.high
    assert share.value == pytest.approx(0.5, abs=0.05)
    assert 0.02 < share.high - share.low < 0.2
    wider = share_of_way(middle[:10], least[:10], most[:10])
    assert wider.high is not None
    assert wider.low is not None
    assert wider.high - wider.low > share.high - share.low
