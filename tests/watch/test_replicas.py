from __future__ import annotations

from swarm_logistics_env import Fault, policies, run_episode, spi
from swarm_logistics_env.watch.server import indicators
from tests.watch.conftest import SMALL


def test_indicators_are_those_of_the_package() -> None:
    runs = []
    for seed in range(3):
        sound, faulty, without = (
            run_episode(SMALL, policies.load("swarm-dt"), seed, faults)
            for faults in ([], [Fault("FM1", [0, 1])], [Fault("removed", [0, 1])])
        )
        runs.append((sound, faulty, without))
    found = {entry["symbol"]: entry for entry in indicators("swarm-dt", runs, 6, 2)}
    sound_p, faulty_p, without_p = ([run.delivered for run in column] for column in zip(*runs))
    assert found["R"]["value"] == round(spi.robustness(sound_p, faulty_p, n=6, m=2).value, 3)
    expected = spi.fault_tolerance(sound_p, faulty_p, without_p, n=6, m=2)
    assert found["FT"]["value"] == round(expected.value, 3)
    assert found["FT"]["seeds"] == 3
    assert [entry["symbol"] for entry in indicators("swarm-dt", runs, 2, 2)] == ["R"]
