"""Who is to blame: planted causes are found, and the shares sum to the loss."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, policies
from swarm_logistics_env.errors import FaultError, StudyError
from swarm_logistics_env.fault_analysis import attribution_run
from swarm_logistics_env.fault_analysis.attribution import attribute, losses
from swarm_logistics_env.fault_analysis.attribution_run import (
    FINISHED,
    attribute_in,
    write_table,
)
from swarm_logistics_env.fault_analysis.fork import Fork
from swarm_logistics_env.policies.swarm_dt import SwarmDT

SCENARIO = Scenario(
    n_robots=4,
    warehouse_width=4.0,
    warehouse_height=4.0,
    delivery_width=1.2,
    n_items=5,
    restock=True,
    duration=80.0,
)


class OneWorker(SwarmDT):
    """Robot 0 works without its radio; the others stand still."""

    def __init__(self) -> None:
        super().__init__(taxis_gain=0.0)

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        commands = super().act(observations)
        commands[1:] = 0.0
        return commands


def test_copies_without_a_fault_are_equal_and_lose_nothing() -> None:
    fork = Fork(SCENARIO, policies.load("swarm-dt"), 0, 20.0)
    assert fork.go_on() == fork.go_on()
    # A robot that does not hear is as good as before to a policy that does not listen.
    deaf = losses(SCENARIO, policies.load("random-walk"), Fault("FM3_hear", 2, onset=20.0), 0)
    assert deaf.total == 0.0
    assert set(deaf.capabilities.values()) == {0.0}


def test_a_planted_robot_bears_the_whole_loss() -> None:
    found = attribute(SCENARIO, OneWorker(), Fault("dead", (0, 3), onset=20.0), range(4))
    assert found.table()["lost"][0] > 0.0
    for seed in found.seeds:
        assert seed.robots[3][1] == 0.0
        assert seed.robots[0][1] == seed.total


def test_a_planted_capability_bears_the_whole_loss() -> None:
    # A policy that does not listen loses nothing by deafness.
    fault = Fault("dead[deliver,hear]", (0, 3), onset=20.0)
    found = attribute(SCENARIO, OneWorker(), fault, range(4))
    assert found.table()["lost"][0] > 0.0
    for seed in found.seeds:
        assert seed.capabilities == {"deliver": seed.total, "hear": 0.0}


def test_a_role_is_struck_however_short_the_fault_is() -> None:
    whole = losses(SCENARIO, policies.load("swarm-dt"), Fault("FM4", 2, 20.0, role="carrier"), 0)
    short = Fault("FM4", 2, onset=20.0, duration=5.0, role="carrier")
    assert (
        losses(SCENARIO, policies.load("swarm-dt"), short, 0).robots.keys() == whole.robots.keys()
    )


@pytest.mark.parametrize("damage", ["no JSON\nat all\n", "[1]\n[2]\n"])
def test_a_damaged_file_is_told(damage: str, tmp_path: Path) -> None:
    (tmp_path / FINISHED).write_text(damage)
    with pytest.raises(StudyError, match=r"is damaged .*: should be deleted"):
        attribute_in(tmp_path, SCENARIO, "swarm-dt", Fault("FM4", 1, onset=20.0), [0])


def test_a_directory_in_which_no_seed_is_finished_takes_another_question(tmp_path: Path) -> None:
    fault = Fault("FM4", 1, onset=20.0)
    with pytest.raises(FaultError, match="ended at 10 s"):
        attribute_in(tmp_path, SCENARIO.replace(duration=10.0), "swarm-dt", fault, [0])
    assert len(attribute_in(tmp_path, SCENARIO, "swarm-dt", fault, [0]).seeds) == 1


def test_the_shares_sum_to_the_loss() -> None:
    fault = Fault("dead[move,deliver]", 2, onset=20.0, role="carrier")
    found = attribute(SCENARIO, policies.load("swarm-dt"), fault, range(2))
    for seed in found.seeds:
        assert sum(lost for _, lost in seed.robots.values()) == pytest.approx(seed.total)
        assert sum(seed.capabilities.values()) == pytest.approx(seed.total)
    table = found.table()
    total, *others = table["lost"]
    for _, rows in table[1:].groupby("group"):
        assert rows["lost"].sum() == pytest.approx(total)
    assert len(others) > 4
    assert table["robots"].sum() == 4


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (Fault("FM4", 2), "onset = 0 s: should be later than 0"),
        (Fault("FM4", 7, onset=5.0), "7 robots: should be at most 6"),
        (Fault("FM4", 2, onset=90.0), "should be earlier"),
    ],
)
def test_what_cannot_be_attributed_is_refused(fault: Fault, sentence: str) -> None:
    with pytest.raises(FaultError, match=sentence):
        attribute(SCENARIO.replace(n_robots=8), policies.load("swarm-dt"), fault, [0])


def test_finished_seeds_are_kept_also_beside_a_torn_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fault = Fault("FM4", 1, onset=40.0)
    played = []
    first = attribute_in(
        tmp_path, SCENARIO, "swarm-dt", fault, [0, 1], on_seed=lambda: played.append(1)
    )
    with (tmp_path / FINISHED).open("a", encoding="utf-8") as file:
        file.write('{"seed": 2, "tot')
    again = attribute_in(
        tmp_path, SCENARIO, "swarm-dt", fault, [0, 1, 2], on_seed=lambda: played.append(1)
    )
    assert len(played) == 3
    assert again.seeds[:2] == first.seeds
    with pytest.raises(StudyError, match="another fault: should be another directory"):
        attribute_in(tmp_path, SCENARIO, "swarm-dt", Fault("FM1", 1, onset=40.0), [0])
    monkeypatch.setattr(attribution_run, "code_digest", lambda kind: "changed")
    with pytest.raises(StudyError, match="another code: should be another directory"):
        attribute_in(tmp_path, SCENARIO, "swarm-dt", fault, [0])
    path = write_table(again, "swarm-dt", "FM4", tmp_path)
    assert path.read_text(encoding="utf-8").count("swarm-dt,FM4,3,") > 5
