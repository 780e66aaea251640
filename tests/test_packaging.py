"""What a user installs, and the workflows that build it: they call targets that exist."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

PACKAGE = "swarm_logistics_env"
ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
WORKFLOWS = {
    path.name: path.read_text(encoding="utf-8") for path in ROOT.glob(".github/workflows/*.yml")
}


def left_out(folder: str, names: list[str]) -> set[str]:
    """Return what a copy of the tree leaves out, as `shutil.copytree` asks for it."""
    at_top = {"build", "dist", "results"} if Path(folder) == ROOT else set()
    hidden = {n for n in names if n.startswith(".")} - {".github"}
    return hidden | {n for n in names if n in at_top or n.endswith(".egg-info")}


@pytest.mark.daily
def test_wheel_and_sdist_hold_the_package_and_what_the_gate_needs(tmp_path: Path) -> None:
    copy, out = tmp_path / "source", tmp_path / "dist"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=left_out)
    # Not isolated: the dev extra holds setuptools, so it needs no network.
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(copy)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with tarfile.open(next(out.glob("*.tar.gz"))) as archive:
        sdist = {m.name.partition("/")[2] for m in archive.getmembers() if m.isfile()}
    with zipfile.ZipFile(next(out.glob("*.whl"))) as archive:
        wheel = set(archive.namelist())
    information = f"{PACKAGE}-{PROJECT['version']}.dist-info"
    assert {name.partition("/")[0] for name in wheel} == {PACKAGE, information}
    expected = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / PACKAGE).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert f"{PACKAGE}/py.typed" in expected
    for held in (wheel, sdist):
        assert {name for name in held if name.startswith(f"{PACKAGE}/")} == expected
    assert {"Makefile", "constraints.txt", "pyproject.toml", "LICENSE", "SECURITY.md"} <= sdist
    assert {"CITATION.cff", "CHANGELOG.md", ".github/workflows/test.yml"} <= sdist
    assert {path.relative_to(ROOT).as_posix() for path in ROOT.glob("tests/**/*.py")} <= sdist


def test_workflows_call_targets_that_exist_and_all_that_is_promised() -> None:
    heads = re.findall(r"^([\w -]+):(?!=)", MAKEFILE, flags=re.MULTILINE)
    lines = re.findall(r"\bmake ([\w-]+)|target: ([\w-]+)", "\n".join(WORKFLOWS.values()))
    called = {name for names in lines for name in names if name}
    assert called - set(" ".join(heads).split()) == set()
    wanted = {"test", "first-look", "docs", "soak", "combined-faults", "mutants", "dist"}
    wanted |= {"interop-calls", "test-lowest", "test-newest", "interpreted", "docs-check"}
    assert wanted <= called
    named = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))
    gate = yaml.safe_load(WORKFLOWS["test.yml"])["jobs"]["gate"]
    assert gate["strategy"]["matrix"]["python"] == named
    assert PROJECT["requires-python"] == f">={named[0]}"


def test_the_gate_runs_the_newest_python_that_pyproject_names() -> None:
    assert "\nmake test-python\n" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    [minors] = re.findall(r"for minor in ([\d ]+);", MAKEFILE)
    named = re.findall(r"Python :: 3\.(\d+)", " ".join(PROJECT["classifiers"]))
    assert minors.split() == named[:0:-1]


def test_nothing_may_write_but_the_release_which_needs_no_password() -> None:
    for name, text in WORKFLOWS.items():
        workflow = yaml.safe_load(text)
        assert workflow["permissions"] == {"contents": "read"}, name
        for job in workflow["jobs"].values():
            assert name == "release.yml" or "permissions" not in job
    assert "secrets." not in WORKFLOWS["release.yml"]
    jobs = yaml.safe_load(WORKFLOWS["release.yml"])["jobs"]
    assert jobs["publish"]["permissions"] == {"id-token": "write"}
    assert jobs["publish"]["needs"] == "build"
    made = re.findall(r"make ([\w-]+)", WORKFLOWS["release.yml"])
    assert made == ["test", "absolute-links", "dist", "docs-versions"]
    assert jobs["site"]["needs"] == "build"
    [step] = [step for step in jobs["publish"]["steps"] if "pypi-publish" in step["uses"]]
    assert step["with"] == {"attestations": True}
    assert any("attest-build-provenance" in step.get("uses", "") for step in jobs["build"]["steps"])


def test_version_and_date_are_those_of_the_changelog() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    heads = re.findall(r"^## \[\d.*$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert cited["version"] == PROJECT["version"]
    assert f"## [{cited['version']}] - {cited['date-released']}" == heads[0]
