"""What the README shows runs as written."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from swarm_logistics_env import Scenario, run_episode

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def run(block: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(block, "README.md", "exec"), names)
    return names


def test_the_environment_in_ten_lines_runs_as_written() -> None:
    names = run(next(block for block in BLOCKS if "parallel_env" in block))
    assert len(names["observations"]) == 25
    assert names["delivered"] >= 0.0


def test_the_policy_of_ones_own_runs_as_written() -> None:
    names = run(next(block for block in BLOCKS if "class Still" in block))
    assert run_episode(Scenario(duration=5.0), names["Still"](), seed=0).delivered == 0


def test_every_block_of_code_is_run_here() -> None:
    assert len(BLOCKS) == 2


def test_every_command_and_target_that_it_names_exists() -> None:
    makefile = (Path(__file__).parents[1] / "Makefile").read_text(encoding="utf-8")
    for target in set(re.findall(r"^make (\w+)|`make (\w+)", README, flags=re.MULTILINE)):
        assert f"{target[0] or target[1]}:" in makefile
