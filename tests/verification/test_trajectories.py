"""Golden trajectories are reproduced here, in threads, in another process and by copies."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from swarm_logistics_env.compiler.numba_fence import WAY
from verification import trajectories
from verification.trajectories import (
    GOLDEN,
    Digests,
    GoldenTrajectory,
    digests,
    explained,
    read_record,
)

ROOT = Path(trajectories.__file__).parents[1]
STORIES = read_record()["stories"]
ANOTHER_PROCESS = """
from verification.trajectories import GOLDEN, digests, explained

names = list(GOLDEN)[::8]
print(explained({name: digests(GOLDEN[name]) for name in names}))
"""


def complain(difference: str | None) -> None:
    if difference:
        pytest.fail(difference, pytrace=False)


def test_every_golden_trajectory_is_as_recorded_when_a_copy_goes_on_beside_others() -> None:
    assert list(STORIES) == list(GOLDEN), "run `python -m verification.trajectories --record`"

    def digests_of_half_a_copy(golden: GoldenTrajectory) -> Digests:
        return digests(golden, copied_at=max(golden.steps // 2, 1))

    # Four worlds at any time, in no order that anybody chose.
    with ThreadPoolExecutor(4) as pool:
        played = pool.map(digests_of_half_a_copy, GOLDEN.values())
        complain(explained(dict(zip(GOLDEN, played, strict=True))))


@pytest.mark.daily
def test_another_process_plays_them_as_recorded() -> None:
    words = [sys.executable, "-c", ANOTHER_PROCESS]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout == "None\n", done.stdout + done.stderr


@pytest.mark.skipif(
    os.environ.get("HYPOTHESIS_PROFILE") != "nightly", reason="the plain way compiles for a minute"
)
def test_plain_kernels_play_them_as_recorded() -> None:
    words = [sys.executable, "-m", "verification.trajectories"]
    environment = {**os.environ, WAY: "plain"}
    done = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_difference_is_told_with_its_step_and_its_platform(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    played = dict(STORIES["seed 1"])
    digest = played["25"].split()
    played["25"] = " ".join([digest[0], "0" * 10, *digest[2:]])
    monkeypatch.setattr(trajectories, "here", lambda: {"platform": "Plan9-vax"})
    explanation = explained({"seed 1": played}) or ""
    assert "seed 1: robots differ at step 25, nothing did up to step 10" in explanation
    assert "Plan9-vax here" in explanation
