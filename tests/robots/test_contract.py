"""The contract of a policy, and checks of robots' logs against it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.core.errors import PolicyError, RobotError
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.catalogue import SCRIPTED
from swarm_logistics_env.policies.learned import (
    LearnedPolicy,
    Network,
    PolicyCard,
    tensor_shapes,
)
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.robots import Contract, check_rows, contract_of
from swarm_logistics_env.robots.contract import outputs_of
from swarm_logistics_env.world.motion.voices import MESSAGES
from swarm_logistics_env.world.observations import SENSORS, columns, unflatten

NAMES = [name for name in SCRIPTED if not getattr(load(name), "needs_state", False)]
SMALL: dict[str, Any] = {
    "n_robots": 8, "n_items": 10, "warehouse_width": 4.0, "warehouse_height": 3.0,
    "delivery_width": 1.0, "restock": True,
}  # fmt: skip
NOISY = Scenario(
    **SMALL, message_size=2, timer_limit=3.0, relay="gossip", sensor_dropout=0.2, radio_loss=0.3,
    ranger_noise=0.05, position_noise=0.05, drive="differential",
)  # fmt: skip


def rows_of_run(scenario: Scenario, *faults: str) -> NDArray[np.float32]:
    """Return the rows of all robots in a run of 15 s, one below the other."""
    policy = load("homing")
    world = Warehouse(scenario)
    read = [world.reset(0, faults)]
    start(policy, scenario, 0)
    for _ in range(150):
        read.append(world.step(policy.act(read[-1])).copy())
    return np.concatenate(read)


def test_one_of_another_form_is_refused_and_one_without_its_number_is_of_the_first() -> None:
    contract = contract_of(load("homing"), NOISY)
    fields = yaml.safe_load(contract.to_yaml())
    with pytest.raises(RobotError, match=r"Contract.format = 2: should be 1"):
        Contract(**fields | {"format": 2})
    del fields["format"]
    assert Contract(**fields) == contract


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", [*NAMES, "ppo-robust"])
def test_it_is_yaml_of_all_that_a_robot_has_to_know(name: str) -> None:
    contract = contract_of(load(name), NOISY)
    text = yaml.safe_load(contract.to_yaml())
    assert Contract(**text) == contract
    covered = [column for part in text["inputs"] for column in part["columns"]]
    assert sorted(covered) == list(range(141 + 16))
    assert [part["column"] for part in text["outputs"]] == [0, 1, 2, 3]
    assert (text["period"], text["frequency"]) == (0.1, 10.0)
    used = {part["sensor"] for part in text["inputs"] if part["used"]}
    assert set(text["leans_on"]) == used
    assert text["body"]["control_period"] == 0.1


def test_it_says_what_the_policy_reads_of_body_and_senses() -> None:
    scenario = Scenario.preset("realistic")
    of_stock = contract_of(load("homing-stock"), scenario)
    assert {"n_items", "warehouse_height", "top_speed"} & {*of_stock.body} == {
        "n_items",
        "warehouse_height",
    }
    assert "gyro" in of_stock.leans_on
    assert "floor sensor" in of_stock.leans_on
    assert of_stock.initial_values["heading_x"] is None
    assert of_stock.initial_values["home_x"] == 0.0
    assert of_stock.initial_values["top_speed"] == scenario.max_speed
    of_taxis = contract_of(load("swarm-dt"), scenario)
    assert not {"gyro", "floor sensor", "odometry"} & {*of_taxis.leans_on}
    assert of_taxis.initial_values == {"heading": None, "steps": 0.0}
    assert "to the side" in of_taxis.outputs[1].high_means


LINEAR, ANGULAR = "target/body/linear_velocity", "target/body/angular_velocity"
GRIPS = "above 0.5 it closes or holds, below -0.5 it opens, else it stays as it is"
NO_SIDE = "nothing: such a drive has no motion to the side, so it is always 0"


def test_a_contract_says_what_each_number_of_a_command_does() -> None:
    outputs = outputs_of(Scenario(max_speed=1.5, max_turn_rate=4.0), ["home"])
    assert [tuple(output.model_dump().values()) for output in outputs] == [
        ("forward", LINEAR, 0, -1.0, 1.0, "ahead at 1.5 m/s"),
        ("left", LINEAR, 1, -1.0, 1.0, "to the left at 1.5 m/s"),
        ("turn", ANGULAR, 2, -1.0, 1.0, "to the left at 4 rad/s"),
        ("gripper", "", 3, -1.0, 1.0, GRIPS),
        ("home", "", 4, 0.0, 1.0, "its radio tells its neighbours 1: it is there"),
    ]
    assert outputs_of(NOISY)[1].high_means == NO_SIDE


def test_a_contract_holds_the_columns_of_a_row_and_the_parameters_of_the_policy() -> None:
    scenario, policy = Scenario(drive="differential", control_period=0.2), load("swarm-dt")
    contract = contract_of(policy, scenario)
    assert contract.policy == "SwarmDT()"
    assert contract.parameters == policy.parameters.model_dump(mode="json")  # type: ignore[attr-defined]
    assert (contract.period, contract.frequency, contract.stream) == (0.2, 5.0, "swarm D-T")
    assert contract.body == {"control_period": 0.2, "drive": "differential", "max_turn_rate": 6.0}
    kinds = {part.name: part.kind for part in contract.inputs if part.kind}
    assert kinds == {
        "velocity": "state/body/linear_velocity", "turn_rate": "state/body/angular_velocity"
    }  # fmt: skip
    for part, column in zip(contract.inputs, columns(scenario), strict=True):
        for name in ("name", "sensor", "unit", "low", "high", "absent", "meaning"):
            assert getattr(part, name) == getattr(column, name)
        assert part.flag == ("" if column.flag == column.name else column.flag)
        assert part.columns == tuple(range(*column.columns.indices(contract.width)))
    assert contract.leans_on == {
        sensor: about
        for sensor, about in SENSORS.items()
        if sensor in {part.sensor for part in contract.inputs if part.used}
    }


def test_a_policy_that_sees_everything_has_none() -> None:
    with pytest.raises(PolicyError, match="sees the state of the whole warehouse"):
        contract_of(load("central"), Scenario())


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("scenario", "faults"),
    [
        (Scenario(**SMALL), ["FM1:2", "rangers_blind:1@3", "dead:1@5"]),
        (NOISY, ["view_reduced:2@2", "rangers_biased:2@4", "FM3:1@3"]),
        (Scenario.preset("realistic").replace(floor="aisles"), []),
    ],
)
def test_what_the_simulator_senses_keeps_to_it(scenario: Scenario, faults: list[str]) -> None:
    check_rows(contract_of(load("homing"), scenario), rows_of_run(scenario, *faults))


def log() -> NDArray[np.float32]:
    rows = np.zeros((9, 157), np.float32)
    parts = unflatten(rows, NOISY)
    for name in ("range_robots", "range_walls", "range_items"):
        parts[name][:] = NOISY.ranger_range
    parts["timer"][:] = NOISY.timer_limit
    return rows


@pytest.mark.parametrize(
    ("name", "number", "value", "words"),
    [
        ("range_walls", 3, np.nan, r"range_walls in column 19 = nan: should be within"),
        ("range_walls", 3, 2.5, r"= 2.5: should be within \[0, 2\]"),
        ("velocity", 1, -np.inf, r"velocity in column 138 = -inf: should be within \[-2, 2\]"),
        ("carrying", 0, 0.4, r"carrying in column 132 = 0.4: should be 0 or 1"),
        ("carrying_requested", 0, 1.0, "should be 0, as carrying is 0"),
        ("item_x", 0, 0.3, r"item_x in column 49 = 0.3: should be 0, as item_present is 0"),
        ("item_present", 1, 1.0, "should be 0, as the one before is: the nearest come first"),
        ("timer", 0, 1.0, "timer in column 136 = 1: should be 3, as timer_runs is 0"),
    ],
)
def test_the_row_of_a_log_that_cannot_be_is_named(
    name: str, number: int, value: float, words: str
) -> None:
    contract = contract_of(load("ppo-robust"), NOISY)
    rows = log()
    check_rows(contract, rows)
    unflatten(rows, NOISY)[name][[7, 4], number] = value
    with pytest.raises(RobotError, match=f"^row 4: .*{words}"):
        check_rows(contract, rows)
    unflatten(rows, NOISY)["range_robots"][[4, 5], 2] = -1.0
    with pytest.raises(RobotError, match=r"^row 4: range_robots in column 2 = -1: should be with"):
        check_rows(contract, rows)


def test_what_is_not_used_may_hold_any_number_within_its_limits() -> None:
    contract = contract_of(load("homing"), NOISY)
    rows = log()
    unused = [part for part in contract.inputs if not part.used]
    assert "neighbour_present" in {part.name for part in unused}
    for part in unused:
        rows[:, part.columns] = 0.25 * part.low + 0.75 * part.high
    unflatten(rows, NOISY)["neighbour_x"][:, 0] = 0.8  # though its flag says nothing
    check_rows(contract, rows)


def test_a_log_of_another_width_is_refused() -> None:
    contract = contract_of(load("swarm-dt"), Scenario())
    with pytest.raises(RobotError, match=r"rows of shape \(9, 157\): should be \(T, 141\)"):
        check_rows(contract, log())
    with pytest.raises(RobotError, match="should be a table of numbers"):
        check_rows(contract, [["x"]])


def test_what_a_network_tells_stands_behind_its_commands() -> None:
    network = Network(hidden=(4,), talks=True)
    tensors = {name: np.zeros(shape, np.float32) for name, shape in tensor_shapes(network).items()}
    policy = LearnedPolicy(PolicyCard(name="talking", network=network), tensors)
    contract = contract_of(policy, Scenario(message_size=2))
    assert [output.name for output in contract.outputs[3:]] == ["gripper", *MESSAGES]
    assert {part.name: part.used for part in contract.inputs}["neighbour_message"]
    assert len(contract_of(load("ppo-robust"), Scenario(message_size=2)).outputs) == 4
