"""What machines do to a study: finished runs stay, it goes on, the report says what is missing."""

from __future__ import annotations

import errno
import importlib.util
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.runs import FILE_NAME, Runs, export

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")

SCENARIO = {"n_robots": 4, "n_items": 8, "warehouse_width": 3.0, "warehouse_height": 3.0,
            "delivery_width": 1.0, "duration": 20.0}  # fmt: skip
STUDY: dict[str, Any] = {
    "seeds": 6,
    "scenario": SCENARIO,
    "sizes": [{"values": [2, 4]}],
    "faults": [{"modes": ["FM1", "FM4"], "robots": [1]}],
}
FILE = """\
seeds = 6
scenario = { n_robots = 4, n_items = 8, warehouse_width = 3.0, warehouse_height = 3.0, \
delivery_width = 1.0, duration = 20.0 }
[[sizes]]
values = [2, 4]
[[faults]]
modes = ["FM1", "FM4"]
robots = [1]
"""
N_RUNS = 30


def digest(directory: Path) -> str:
    with Runs.existing(directory) as store:
        return export(store, directory.with_suffix(".csv"))[1]


def finished(directory: Path) -> int:
    with Runs.existing(directory) as store:
        return len(store.succeeded())


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Digest of the study that nothing befell."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    assert Study(out=out, **STUDY).run().played == N_RUNS
    return digest(out)


CAP_DAC_OVERRIDE, PR_CAPBSET_DROP = 1, 24


def command(*arguments: str, limit: int | None = None, stdout: Any = subprocess.PIPE) -> Any:
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
        [sys.executable, "-c", "from swarm_logistics_env.cli import app; app()", *arguments],
        preexec_fn=limited,
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )


def complaint(done: Any) -> str:
    """What a command that failed said last; it may have told its progress before."""
    assert done.returncode == 2, done
    assert "Traceback" not in done.stderr
    last: str = done.stderr.splitlines()[-1]
    assert last.startswith("swarm-logistics: ")
    return last


def test_a_disk_that_is_full_keeps_what_is_finished_and_the_study_goes_on(
    undisturbed: str, tmp_path: Path
) -> None:
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text(FILE)
    run = ("study", "run", str(file), "--out", str(out), "--processes", "1")
    assert str(out / FILE_NAME) in complaint(command(*run, limit=150_000))
    kept = finished(out)
    assert 0 < kept < N_RUNS
    told = command("study", "report", str(out), limit=0)
    assert "missing" in told.stdout  # the answer, though no file of it can be written
    said = complaint(told)
    assert str(out) in said
    assert os.strerror(errno.EFBIG) in said
    exported = command("study", "export", str(out), "--to", str(tmp_path / "x.csv"), limit=0)
    assert str(tmp_path / "x.csv") in complaint(exported)
    assert "no room" in complaint(command(*run, limit=0))
    assert finished(out) == kept
    assert not list(tmp_path.glob("*.csv")) + list(tmp_path.glob(".*"))
    assert Study.from_file(file, out=out).run().played == N_RUNS - kept
    assert digest(out) == undisturbed


def test_what_cannot_be_written_whole_leaves_the_older_file(tmp_path: Path) -> None:
    page = tmp_path / "run.html"
    page.write_text("older")
    watch = ("watch", "--save", str(page), "--until", "1", "--set", "n_robots=3")
    assert str(page) in complaint(command(*watch, limit=5000))
    assert page.read_text() == "older"
    assert list(tmp_path.iterdir()) == [page]


@pytest.mark.skipif(sys.platform != "linux", reason="no /dev/full")
@pytest.mark.parametrize("arguments", [("list", "policies"), ("--help",)])
def test_an_output_that_is_full_ends_in_one_line(arguments: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        done = command(*arguments, stdout=full)
    assert os.strerror(errno.ENOSPC) in complaint(done)
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="root writes everywhere")
def test_a_folder_that_is_read_only_is_named_and_stays_as_it_is(tmp_path: Path) -> None:
    played, empty = tmp_path / "played", tmp_path / "empty"
    empty.mkdir()
    Study(out=played, seeds=1, scenario=SCENARIO, sizes=[{"values": [2, 3]}]).run()
    before = (played / FILE_NAME).read_bytes()
    for folder in (played, empty):
        folder.chmod(0o555)
    run = ("study", "run", "quick", "--processes", "1", "--out")
    try:
        for words in (("study", "report", str(played)), (*run, str(empty)), (*run, f"{empty}/new")):
            assert str(played if "report" in words else empty) in complaint(command(*words))
    finally:
        for folder in (played, empty):
            folder.chmod(0o755)
    assert (played / FILE_NAME).read_bytes() == before
    assert finished(played) == 2
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
    assert digest(tmp_path / "out") == undisturbed


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


def test_a_worker_out_of_memory_is_a_failed_run_and_nothing_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "hungry_policy.py").write_text(HUNGRY)
    monkeypatch.syspath_prepend(tmp_path)
    study = Study(
        out=tmp_path / "out",
        policies=["hungry_policy:Hungry"],
        seeds=2,
        scenario=SCENARIO,
        sizes=[{"values": [2, 4, 5]}],
    )
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

    def add_and_lose(store: Runs, run: Any, outcome: Any) -> None:
        add(store, run, outcome)
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
    assert digest(tmp_path / "out") == undisturbed
