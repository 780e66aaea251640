"""One study, whichever engine plays it: identical exports."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.study.runs import engines as play
from swarm_logistics_env.study.runs.engines import Shard, engine_named
from swarm_logistics_env.study.runs.notes import merge
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from tests.conftest import SMALL
from tests.made_up import digest

has_ray = importlib.util.find_spec("ray") is not None


def test_two_processes(played: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert Study(out=out, **SMALL).run("process", processes=2).failed == 0
    assert digest(out, tmp_path) == digest(played, tmp_path)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no CPUs to choose here")
def test_there_are_as_many_workers_as_this_process_may_use_cores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def cores() -> object:
        engine: Any = engine_named("process")
        return engine.args[0]

    before = os.sched_getaffinity(0)
    assert cores() == len(before)
    os.sched_setaffinity(0, {min(before)})  # as taskset does
    try:
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, before)
    monkeypatch.setattr(play, "_MOST_WORKERS", 61)
    monkeypatch.setattr(play, "usable_cores", lambda: 128)
    assert cores() == 61


@pytest.mark.unmeasured
def test_two_shards_merged(played: Path, tmp_path: Path) -> None:
    parts, half = [tmp_path / "1", tmp_path / "2"], len(Study.stored(played).plan().runs) // 2
    for number, part in enumerate(parts, start=1):
        assert Study(out=part, **SMALL).run(shard=Shard(number, 2)).played == half
        assert Study(out=part, **SMALL).run(shard=Shard(number, 2)).kept == half
    merge(parts, tmp_path)
    assert digest(tmp_path, tmp_path) == digest(played, tmp_path)
    assert not Study.stored(tmp_path).findings().exploratory


@pytest.mark.skipif(not has_ray, reason="ray is not installed")
@pytest.mark.filterwarnings("ignore")  # of ray's own
def test_ray_with_two_local_nodes(played: Path, tmp_path: Path) -> None:
    from ray.cluster_utils import Cluster

    out = tmp_path / "out"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        tally = Study(out=out, **SMALL).run("ray", address=cluster.address)
    finally:
        cluster.shutdown()
    assert tally.failed == 0
    assert digest(out, tmp_path) == digest(played, tmp_path)
    study = Study(**{**SMALL, "faults": [], "parameters": []})
    assert study.run("ray", processes=1).failed == 0  # on a node that it starts


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("engine", "fields", "words"),
    [
        ("proces", {}, r"did you mean 'process'\?"),
        ("local", {"processes": 2}, "is one process, not 2"),
        ("process", {"address": "auto"}, "only ray has an address"),
        ("ray", {"address": "auto", "processes": 2}, "its own number of cores"),
        ("ray", {"address": "auto"}, "no Ray cluster at auto" if has_ray else r"\.\[ray\]"),
    ],
)
def test_an_engine_that_cannot_be_is_refused(engine: str, fields: Any, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        Study(**SMALL).run(engine, **fields)


class Remembering(SwarmDT):
    """Changes with every episode that one object plays, and keeps the seeds of all."""

    identity = "remembering"
    episodes = 0
    seeds: list[int] = []  # noqa: RUF012 - shared by the copies that runs play

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed + self.episodes)
        self.episodes += 1
        Remembering.seeds.append(seed)


def test_other_behaviour_meets_the_same_worlds_and_nothing_is_remembered() -> None:
    scenario = Scenario(n_robots=3, n_items=5, warehouse_width=3, warehouse_height=3, duration=10)
    usual_case = Case(PolicySpec.of(Remembering()), "remembering", scenario, task=WAREHOUSE)
    other = replace(usual_case, behaviour=1)
    played = [(seed, case) for seed in (0, 1) for case in (usual_case, other, usual_case)]
    outcomes = [Run(case, WAREHOUSE.code(), seed).play() for seed, case in played]
    assert {outcome.error for outcome in outcomes} == {None}
    assert outcomes[0].digest == outcomes[2].digest != outcomes[1].digest
    first, other_first, again, second, other_second, _ = Remembering.seeds[-6:]
    assert (first, again, second) == (0, 0, 1)
    assert len({first, second, other_first, other_second}) == 4
    stale = Run(usual_case, "0" * 16, 0).play()
    assert "the package changed while the study ran" in str(stale.error)


def test_workers_end_with_a_parent_that_is_killed() -> None:
    script = (
        "import os, signal\n"
        "from swarm_logistics_env.study.runs.worker_processes import workers\n"
        "if __name__ == '__main__':\n"
        "    with workers(2) as pool:\n"
        "        print(len({pool.submit(os.getpid).result() for _ in range(20)}), flush=True)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    killed = subprocess.Popen([sys.executable, "-c", script], start_new_session=True, **pipes)
    try:
        # Its workers write there as well, so that it ends only once they have ended.
        printed, _ = killed.communicate(timeout=600)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(killed.pid, signal.SIGKILL)
    assert int(printed) >= 1
    assert killed.returncode == -signal.SIGKILL
