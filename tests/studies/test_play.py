"""What ends a run, a study or a worker."""

from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.studies import Study


class Exiting(SwarmDT):
    """Ends the process, as it thinks, at a moment of its second run."""

    identity = "exiting"

    def __init__(self, moment: str, raised: BaseException) -> None:
        super().__init__()
        self.moment, self.raised = moment, raised

    def reset(self, n_robots: int, seed: int) -> None:
        self.seed = seed
        super().reset(n_robots, seed)
        self.end_at("reset")

    def act(self, observations: Any) -> Any:
        self.end_at("act")
        return super().act(observations)

    def end_at(self, moment: str) -> None:
        if self.seed == 1 and moment == self.moment:
            raise self.raised


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize(
    ("moment", "raised"),
    [("reset", SystemExit(0)), ("act", SystemExit("done")), ("act", GeneratorExit())],
)
def test_a_run_in_which_a_policy_exits_has_failed(
    sizes: dict[str, Any], moment: str, raised: BaseException, processes: int
) -> None:
    study = Study(**{**sizes, "policies": [Exiting(moment, raised)]})
    tally = study.run(processes=processes)
    assert (tally.played, tally.failed) == (9, 3)
    assert tally.error is not None
    assert type(raised).__name__ in tally.error
    rows = study.results()
    assert set(rows["seed"][rows["error"].notna()]) == {1}


def test_ctrl_c_ends_a_study(sizes: dict[str, Any]) -> None:
    study = Study(**{**sizes, "policies": [Exiting("act", KeyboardInterrupt())]})
    with pytest.raises(KeyboardInterrupt):
        study.run()
    assert study.finished() == (3, 9)
