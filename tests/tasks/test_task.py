"""A study plays whatever keeps the protocol of a task, the warehouse being one."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import swarm_logistics_env
from swarm_logistics_env import Scenario
from swarm_logistics_env.episode import Play
from swarm_logistics_env.errors import ScenarioError, StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.policy import modules_used, without_prose
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.task import Case
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.warehouse import Warehouse
from tests.tasks.lane import LANE

PACKAGE = Path(swarm_logistics_env.__file__).parent


def test_cases_of_other_tasks_are_other_cases() -> None:
    policy = PolicySpec(name="x")
    own, other = (Case(policy, "x", Scenario(), task=t) for t in (WAREHOUSE, LANE))
    assert own.key != other.key


def test_a_file_names_its_task_by_import_path_and_the_store_finds_it_again(tmp_path: Path) -> None:
    path, out = tmp_path / "lane.toml", tmp_path / "out"
    path.write_text('task = "tests.tasks.lane:LANE"\nseeds = 2\nsizes = [{ values = [2, 4] }]\n')
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        Study.from_file(path)
    study = Study.from_file(path, out=out, trust_code=True, policies=["walker"])
    assert study.run().failed == 0
    with pytest.raises(StudyError, match=r"is code.*--trust-code"):
        Study.stored(out)
    again = Study.stored(out, trust_code=True)
    assert again.specification == study.specification
    assert again.run().played == 0
    assert Study.stored(out, task=LANE).finished() == (4, 4)


def test_the_warehouse_is_varied_by_its_numbers_and_presets() -> None:
    assert {"n_robots", "restock", "delivery_width"} & {*WAREHOUSE.fields} == {"delivery_width"}
    assert WAREHOUSE.removed in WAREHOUSE.failure_modes
    assert WAREHOUSE.vary(Scenario(), {"preset": "dots"}) == Scenario.preset("dots")
    with pytest.raises(ScenarioError, match="no scenario preset"):
        WAREHOUSE.vary(Scenario(), {"preset": "dot"})


def test_prose_does_not_count() -> None:
    bare = "def f(x: int) -> int:\n    return x  # kept\nclass A:\n    b = '''text\n# inside'''\n"
    told = (
        '"""Module."""\n\n# why\ndef f(x: int) -> int:\n    """Tell.\n\n    More.\n    """\n\n'
        "    return x  # kept\nclass A:\n    # note\n    b = '''text\n# inside'''\n"
    )
    assert without_prose(told) == without_prose(bare)
    assert without_prose(bare.replace("x  #", "x + 1  #")) != without_prose(bare)


def test_covers_all_that_an_episode_loads() -> None:
    """A module that decides what a run gives must make stored runs stale when it changes."""
    script = (
        "import sys, swarm_logistics_env.episode as e; "
        "print(*(m.__file__ for n, m in sys.modules.items() "
        "if n.startswith('swarm_logistics_env.')), sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    loaded = {Path(line).relative_to(PACKAGE).as_posix() for line in done.stdout.split()}
    used = modules_used(Play, Warehouse).values()
    covered = {path.relative_to(PACKAGE).as_posix() for path in used}
    # Policies have identities of their own; these hold messages, validation and names only.
    others = {name for name in loaded - covered if name.split("/")[0] not in ("motion", "policies")}
    assert others <= {
        "errors.py", "records.py", "environment/__init__.py", "environment/registration.py"
    }  # fmt: skip
    assert {"warehouse/physics.py", "policies/policy.py", "kernels.py"} <= covered <= loaded


def test_clearing_is_a_rate_that_no_number_of_items_caps(tmp_path: Path) -> None:
    small = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0, "n_items": 6}
    size = {"sizes": [{"values": [2, 4]}], "policies": ["homing"], "seeds": 3}
    study = Study(out=tmp_path, task="clearing", scenario={**small, "n_robots": 4}, **size)
    assert study.run(processes=1).failed == 0
    for cell in study.findings().cells:
        assert not cell.saturated
        for p, outcome in zip(cell.by_seed, cell.outcomes):
            assert (outcome.all_delivered, len(outcome.delivery_times)) == (True, 6)
            assert outcome.time_to_clear == outcome.ended_at
            assert outcome.ended_at == pytest.approx(outcome.delivery_times[-1])
            assert p == pytest.approx(60.0 * 6 / outcome.ended_at)
    # A run that is not done in time has the rate until then, and no time.
    short = Study(out=None, task="clearing", scenario={**small, "duration": 1.0}, **size)
    case = short.plan().cases[0]
    outcome = case.task.play(case, 0, 0)
    assert (outcome.time_to_clear, outcome.delivered) == (math.inf, 0.0)
    with pytest.raises(StudyError, match="restock = True: should be False"):
        Study(task="clearing", scenario={"restock": True})
    preset: Any = Study(task="clearing", scenario={"preset": "paper"}).specification.scenario
    assert preset.duration > 500
