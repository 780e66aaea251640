"""What machines do to a study: finished runs stay, it goes on, the report says what is missing."""

from __future__ import annotations

import errno
import importlib.util
import os
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.study.runs.store import FILE_NAME, Runs, export
from swarm_logistics_env.study.studies import Study

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")

FILE = """\
seeds = 6
scenario = { n_robots = 4, n_items = 8, warehouse_width = 3.0, warehouse_height = 3.0, \
delivery_width = 1.0, duration = 20.0 }
sizes = [{ values = [2, 4] }]
faults = [{ modes = ["FM1", "FM4"], robots = [1] }]
"""
STUDY = tomllib.loads(FILE)
N_RUNS = 30


def exported(directory: Path) -> tuple[int, str]:
    """Return how many runs are finished, and their digest."""
    with Runs.existing(directory) as store:
        return export(store, directory / "runs.csv")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Digest of the study that nothing befell."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    assert Study(out=out, **STUDY).run().played == N_RUNS
    return exported(out)[1]


CAP_DAC_OVERRIDE, PR_CAPBSET_DROP = 1, 24
SCRIPT = """
import sys
sys.modules["matplotlib"] = None  # a report without figures
from swarm_logistics_env.views.cli import app
app()
"""
COMMAND = [sys.executable, "-c", SCRIPT]


def command(words: str, limit: int | None = None) -> Any:
    """Run the command line in another process, which may write files of `limit` bytes at most.

    Folders that are read-only are so for root as well.
    """

    def limited() -> None:
        import ctypes
        import resource

        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        if os.geteuid() == 0:
            ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)

    return subprocess.run(
        [*COMMAND, *words.split()],
        preexec_fn=limited, capture_output=True, text=True, check=False,
    )  # fmt: skip


def complaint(done: Any) -> str:
    """What a command that failed said last; it may have told its progress before."""
    assert done.returncode == 2, done
    assert "Traceback" not in done.stderr
    last: str = done.stderr.splitlines()[-1]
    assert last.startswith("swarm-logistics: ")
    return last


@pytest.mark.daily
def test_a_disk_that_is_full_keeps_what_is_finished_and_the_study_goes_on(
    undisturbed: str, tmp_path: Path
) -> None:
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(FILE)
    run = f"study run {file} --out {out} --processes 1"
    assert str(out / FILE_NAME) in complaint(command(run, limit=150_000))
    n_stored, _ = exported(out)
    assert 0 < n_stored < N_RUNS
    reported = command(f"study report {out}", limit=0)
    assert "missing" in reported.stdout  # the answer, though no file of it can be written
    sentence = complaint(reported)
    assert str(out) in sentence
    assert os.strerror(errno.EFBIG) in sentence
    table = tmp_path / "x.csv"
    assert str(table) in complaint(command(f"study export {out} --to {table}", limit=0))
    assert str(out / FILE_NAME) in complaint(command(run, limit=0))
    assert exported(out)[0] == n_stored
    assert not list(tmp_path.glob("*.csv")) + list(tmp_path.glob(".*"))
    assert Study.from_file(file, out=out).run().played == N_RUNS - n_stored
    assert exported(out)[1] == undisturbed


@pytest.mark.daily
@pytest.mark.skipif(sys.platform != "linux", reason="root writes everywhere")
def test_a_folder_that_is_read_only_is_named_and_stays_as_it_is(tmp_path: Path) -> None:
    played, empty = tmp_path / "played", tmp_path / "empty"
    empty.mkdir()
    small = {"seeds": 1, "scenario": STUDY["scenario"], "sizes": [{"values": [2, 3]}]}
    Study(out=played, **small).run()
    before = (played / FILE_NAME).read_bytes()
    for folder in (played, empty):
        folder.chmod(0o555)
    run = f"study run quick --processes 1 --out {empty}"
    try:
        assert str(played) in complaint(command(f"study report {played}"))
        for words in (run, f"{run}/new"):
            assert str(empty) in complaint(command(words))
    finally:
        for folder in (played, empty):
            folder.chmod(0o755)
    assert (played / FILE_NAME).read_bytes() == before
    assert list(empty.iterdir()) == []


def test_a_clock_that_is_set_back_changes_nothing(
    undisturbed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [1e9]

    def back() -> float:
        now[0] -= 3600.0
        return now[0]

    monkeypatch.setattr(time, "time", back)
    monkeypatch.setattr(time, "perf_counter", back)
    Study(out=tmp_path / "out", **STUDY).run()
    monkeypatch.undo()
    assert exported(tmp_path / "out")[1] == undisturbed


HUNGRY = """
import resource
from swarm_logistics_env.policies import SwarmDT

class Hungry(SwarmDT):
    identity = "hungry"
    def act(self, observations):
        if len(observations) == 4:
            resource.setrlimit(resource.RLIMIT_AS, (1 << 30, resource.RLIM_INFINITY))
            self.eaten = bytearray(1 << 40)
        return super().act(observations)
"""


@pytest.mark.daily
def test_a_worker_out_of_memory_is_a_failed_run_and_nothing_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "hungry_policy.py").write_text(HUNGRY)
    monkeypatch.syspath_prepend(tmp_path)
    fields = {**STUDY, "seeds": 2, "sizes": [{"values": [2, 4, 5]}], "faults": []}
    study = Study(out=tmp_path / "out", policies=["hungry_policy:Hungry"], **fields)
    tally = study.run(processes=2)
    assert (tally.played, tally.failed) == (6, 2)
    errors = study.results()["error"].dropna()
    assert len(errors) == 2
    assert errors.str.contains("MemoryError").all()
    assert study.indicators()["problem"].tolist() == ["N = 4: 2 of 2 runs failed"] * 2


@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="ray is not installed")
@pytest.mark.filterwarnings("ignore")  # of ray's own
def test_a_node_that_is_lost_costs_no_run(undisturbed: str, tmp_path: Path) -> None:
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    added = [cluster.add_node(num_cpus=1)]
    add = Runs.add

    def add_and_lose(store: Runs, runs: Any) -> None:
        add(store, runs)
        if added and len(store) == 3:
            cluster.remove_node(added.pop(), allow_graceful=False)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Runs, "add", add_and_lose)
        try:
            study = Study(out=tmp_path / "out", **STUDY)
            first = study.run("ray", address=cluster.address)
        finally:
            cluster.shutdown()
    assert first.played == N_RUNS
    if first.failed:  # what was lost twice is played by the next call
        assert Study(out=tmp_path / "out", **STUDY).run().played == first.failed
    assert exported(tmp_path / "out")[1] == undisturbed
