"""`python train/ppo.py`, as the clone shows it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import swarm_logistics_env

PACKAGE = Path(swarm_logistics_env.__file__).parent


def test_the_script_finds_the_clone_it_stands_in(tmp_path: Path) -> None:
    script = [sys.executable, str(PACKAGE / "train" / "ppo.py"), "--preset"]
    # The package is not installed: the script finds it by its own place.
    environment = {**os.environ, "PYTHONSAFEPATH": ""}
    done = subprocess.run(
        [*script, "deliver"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "no training preset 'deliver'; did you mean 'delivery'?" in done.stderr
    assert list(tmp_path.iterdir()) == []
