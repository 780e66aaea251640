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
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import SwarmDT, identity
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.engines import engine_named, execute, expected_seconds
from swarm_logistics_env.studies.metadata import merge
from swarm_logistics_env.studies.runs import Condition, Shard, StudiedPolicy
from swarm_logistics_env.studies.store import Store, export
from swarm_logistics_env.tasks.code_version import code_version
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE

needs_ray = pytest.mark.skipif(
    importlib.util.find_spec("ray") is None, reason="ray is not installed"
)

STUDY: dict[str, Any] = {
    "seeds": 2,
    "scenario": {
        "n_robots": 4,
        "n_items": 8,
        "warehouse_width": 3.0,
        "warehouse_height": 3.0,
        "delivery_width": 1.0,
        "duration": 20.0,
        "restock": True,
    },
    "faults": [{"modes": ["FM1", "FM4"], "robots": [1], "onsets": [5.0]}],
}


def digest(directory: Path) -> str:
    with Store.existing(directory) as store:
        return export(store, directory / "rows.csv")[1]


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Digest of what this process gives."""
    directory = tmp_path_factory.mktemp("local")
    study = Study(out=directory, **STUDY)
    assert study.run("local").failed == 0
    assert study.results()["delivered"].sum() > 0
    return digest(directory)


def test_two_processes(local: str, tmp_path: Path) -> None:
    assert Study(out=tmp_path, **STUDY).run("process", processes=2).failed == 0
    assert digest(tmp_path) == local


def test_two_shards_merged(local: str, tmp_path: Path) -> None:
    parts = [tmp_path / "1", tmp_path / "2"]
    for number, part in enumerate(parts, start=1):
        tally = Study(out=part, **STUDY).run(shard=Shard(number, 2))
        assert tally.played == 5
        assert Study(out=part, **STUDY).run(shard=Shard(number, 2)).kept == 5
    merge(parts, tmp_path)
    assert digest(tmp_path) == local
    assert not Study.stored(tmp_path).findings().exploratory


@needs_ray
@pytest.mark.filterwarnings("ignore")  # of ray's own
def test_ray_with_two_local_nodes(local: str, tmp_path: Path) -> None:
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        tally = Study(out=tmp_path, **STUDY).run("ray", address=cluster.address)
    finally:
        cluster.shutdown()
    assert tally.failed == 0
    assert digest(tmp_path) == local


@needs_ray
@pytest.mark.filterwarnings("ignore")
def test_ray_starts_a_node_of_its_own(local: str, tmp_path: Path) -> None:
    import ray

    assert Study(out=tmp_path, **STUDY).run("ray", processes=1).failed == 0
    assert digest(tmp_path) == local
    assert not ray.is_initialized()


@needs_ray
@pytest.mark.filterwarnings("ignore")
def test_no_cluster_at_that_address(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="no Ray cluster at auto"):
        Study(out=tmp_path, **STUDY).run("ray", address="auto")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("proces",), "did you mean 'process'?"),
        (("local", 2), "is one process, not 2"),
        (("process", 2, "auto"), "only ray has an address"),
        (("ray", 2, "auto"), "its own number of cores"),
    ],
)
def test_no_such_engine(arguments: Any, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        engine_named(*arguments)
    assert words in str(caught.value)


@pytest.mark.skipif(importlib.util.find_spec("ray") is not None, reason="ray is installed")
def test_ray_that_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match=r"swarm-logistics-env\[ray\]"):
        Study(out=tmp_path, **STUDY).run("ray")


SCENARIO = Scenario(n_robots=3, n_items=5, warehouse_width=3, warehouse_height=3, duration=10)


def condition(source: object) -> Condition:
    return Condition(StudiedPolicy("mine", identity(SwarmDT()), source), SCENARIO, task=WAREHOUSE)


class Remembering(SwarmDT):
    """Changes with every episode that one object plays."""

    episodes = 0

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed + self.episodes)
        self.episodes += 1


def test_what_a_policy_remembers_does_not_reach_the_next_run() -> None:
    run = condition(Remembering()).run(code_version(), 0)
    first, second = execute(run), execute(run)
    assert first.error is None
    assert first.delivery_times.tolist() == second.delivery_times.tolist()
    assert first.anchoring_seconds == second.anchoring_seconds


def test_run_of_other_code_fails_rather_than_mixes() -> None:
    outcome = execute(condition("swarm-dt").run("0" * 16, 0))
    assert outcome.error is not None
    assert "the package changed while the study ran" in outcome.error


class Recording(SwarmDT):
    """Keeps the seeds that it is reset with, and never moves."""

    identity = "recording"
    seeds: list[int] = []  # noqa: RUF012 - shared by the copies that runs play

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed)
        Recording.seeds.append(seed)


def test_other_behaviour_meets_the_same_worlds() -> None:
    Recording.seeds.clear()
    source = Recording()
    Recording.seeds.clear()
    same = Condition(StudiedPolicy("mine", "recording", source), SCENARIO, task=WAREHOUSE)
    other = replace(same, behaviour=1)
    assert other.key != same.key
    for seed in (0, 1):
        for condition_ in (same, other):
            assert execute(condition_.run(code_version(), seed)).error is None
    first, other_first, second, other_second = Recording.seeds
    assert (first, second) == (0, 1)
    assert len({first, second, other_first, other_second}) == 4


def test_workers_end_with_a_parent_that_is_killed() -> None:
    script = (
        "import os, signal\n"
        "from swarm_logistics_env.studies.engines import workers\n"
        "if __name__ == '__main__':\n"
        "    with workers(2) as pool:\n"
        "        print(len({pool.submit(os.getpid).result() for _ in range(20)}), flush=True)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        # Its workers write there as well, so that it ends only once they have ended.
        said, _ = killed.communicate(timeout=30)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(killed.pid, signal.SIGKILL)
    assert int(said) >= 1
    assert killed.returncode == -signal.SIGKILL


class Broken:
    """Fails at once."""

    identity = "broken"

    def reset(self, n_robots: int, seed: int) -> None:
        raise RuntimeError("a wheel came off")

    def act(self, observations: Any) -> Any: ...


def test_more_seeds_take_more_time(small: dict[str, Any]) -> None:
    few, many = (expected_seconds(Study(**{**small, "seeds": seeds}).plan()) for seeds in (2, 200))
    assert 0 < few < many


def test_policy_that_fails_is_named(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match=r"'Broken' fails .*a wheel came off"):
        expected_seconds(Study(**{**small, "policies": [Broken()]}).plan())
