"""The steps of policies in C: what a robot calls in each period, without a compiler."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.robots.c_export import write_c

NETWORK = """\
    if (remainder_of(counts[0], DECIDES_EVERY) == 0) {
        decide(rows, memories, counts, turned, keys, outputs);
    } else {
        hold_rows(rows, memories, counts, turned);
    }
    command_rows(outputs, turned, rows, memories, commands);
}"""
DROPS = """\
    bool lets_go = carries && !delivers && uniform(keys[0],
            2 * step + 2) < constants.drop_probability;
    commands[3] = lets_go ? -1.0f : 1.0f;
}"""


@pytest.mark.parametrize(
    ("name", "text", "state", "call"),
    [
        (
            "ppo-robust", NETWORK, ["double turned;", "double memory[27];", "float outputs[3];"],
            (
                "act_network(row, robot->memory, &robot->count, &robot->turned, &robot->key, "
                "robot->outputs, driven);"
            ),
        ),
        (
            "swarm-dt", DROPS, ["double heading;"],
            (
                "decide_swarm_dt(row, &robot->key, robot->count, &robot->heading, driven);\n"
                "    robot->count++;"
            ),
        ),
    ],
)  # fmt: skip
def test_a_step_of_a_policy_in_c_calls_what_decides_with_what_the_robot_keeps(
    name: str, text: str, state: list[str], call: str, tmp_path: Path
) -> None:
    files = write_c(policies.load(name), Scenario(), tmp_path / "robot.c")
    source = files.source.read_text()
    assert source.count(text) == 1
    assert f"    {call}\n    for (int32_t part" in source
    _, _, struct = files.header.read_text().partition("int32_t count; /* of its steps */\n")
    assert [line.strip() for line in struct.partition("}")[0].splitlines()] == state
