"""Golden trajectories are reproduced here, in threads, in another process and by copies."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from verification import trajectories
from verification.trajectories import GOLDEN, digests, expected, explained, parting, read_record

ROOT = Path(trajectories.__file__).parents[1]
RECORD = read_record()


def complain(found: dict[str, str]) -> None:
    if found:
        pytest.fail(explained(found), pytrace=False)


def test_the_record_holds_every_golden_trajectory() -> None:
    assert list(RECORD["stories"]) == list(GOLDEN), (
        "run `python -m verification.trajectories --record`"
    )
    for name in GOLDEN:
        assert expected(RECORD, name).keys() == RECORD["stories"][name].keys()


def test_every_golden_trajectory_is_as_recorded_also_beside_others_in_threads() -> None:
    # Four worlds at any time, in no order that anybody chose.
    with ThreadPoolExecutor(4) as pool:
        played = dict(zip(GOLDEN, pool.map(digests, GOLDEN.values()), strict=True))
    partings = {name: parting(expected(RECORD, name), played[name]) for name in GOLDEN}
    complain({name: words for name, words in partings.items() if words})


def test_every_golden_trajectory_is_as_recorded_when_a_copy_goes_on() -> None:
    found = {}
    for name, golden in GOLDEN.items():
        half = max(golden.steps // 2, 1)
        words = parting(expected(RECORD, name), digests(golden, copied_at=half))
        if words:
            found[name] = words
    complain(found)


def test_another_process_plays_them_as_recorded() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "verification.trajectories"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == f"all {len(GOLDEN)} golden trajectories are as recorded\n"


def test_a_difference_is_told_with_its_step_and_its_platform(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    name = "seed 1"
    played = dict(expected(RECORD, name))
    digest = played["25"].split()
    played["25"] = " ".join([digest[0], "0" * 10, *digest[2:]])
    words = parting(expected(RECORD, name), played)
    assert words == "robots differ at step 25, nothing did up to step 10"
    monkeypatch.setattr(trajectories, "platform_name", lambda: "Plan9-vax")
    assert "Plan9-vax here" in explained({name: words})


def test_a_platform_may_have_its_own_record() -> None:
    theirs = {"0": "1 2 3 4 5"}
    record = {**RECORD, "differs": {trajectories.platform_name(): {"seed 1": theirs}}}
    assert expected(record, "seed 1") == theirs
    assert expected(record, "jam") == RECORD["stories"]["jam"]
