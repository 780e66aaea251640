"""The recipe of CONTRIBUTING.md for a task, followed in a copy of the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import swarm_logistics_env
from tests.tasks import lane

PACKAGE = Path(swarm_logistics_env.__file__).parent
ROOT = Path(__file__).parents[2]
SCRIPT = """
from swarm_logistics_env.studies import Study

study = Study(task="lane", policies=["walker"], seeds=2, sizes=[{"values": [2, 4]}])
assert study.run().failed == 0
assert Study(task="lane").specification.played.name == "lane"
assert (study.performance()["mean"] > 0).all()
"""


def test_a_task_needs_two_files(tmp_path: Path) -> None:
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(lane.__file__, copy / "tasks" / "lane_task.py")
    choice = copy / "tasks" / "task.py"
    text = choice.read_text(encoding="utf-8")
    name = '    "lane": "swarm_logistics_env.tasks.lane_task:LANE",\n'
    choice.write_text(text.replace("NAMES = {\n", f"NAMES = {{\n{name}"), encoding="utf-8")
    subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        check=True,
    )
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert "Files: `tasks/NAME_task.py`, `tasks/task.py`" in page
