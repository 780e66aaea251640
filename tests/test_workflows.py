"""The workflows on the repository's host call targets that exist, and cover what is promised."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).parents[1]
HOST = ROOT / ".github"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
TARGETS = {
    target
    for head in re.findall(r"^([\w -]+):(?!=)", MAKEFILE, flags=re.MULTILINE)
    for target in head.split()
}

WORKFLOWS: dict[str, Any] = {
    path.name: yaml.safe_load(path.read_text(encoding="utf-8"))
    for path in sorted(HOST.glob("workflows/*.yml"))
}


def versions_in(job: dict[str, Any]) -> list[dict[str, str]]:
    """Return what a job's matrix sets in each of its runs."""
    matrix = job.get("strategy", {}).get("matrix", {})
    lists = {name: values for name, values in matrix.items() if name != "include"}
    crossed = [{name: value} for name, values in lists.items() for value in values]
    return [*crossed, *matrix.get("include", [])] or [{}]


def lines_of(job: dict[str, Any]) -> list[str]:
    """Return every command of a job, with the values of its matrix filled in."""
    return [
        re.sub(r"\$\{\{ matrix\.(\w+) \}\}", lambda m: str(values.get(m[1], m[0])), line)  # noqa: B023  # used at once
        for values in versions_in(job)
        for step in job["steps"]
        for line in step.get("run", "").splitlines()
    ]


def called() -> set[str]:
    return {
        target
        for workflow in WORKFLOWS.values()
        for job in workflow["jobs"].values()
        for line in lines_of(job)
        for target in re.findall(r"\bmake ([\w-]+)", line)
    }


def test_every_target_that_a_workflow_calls_exists() -> None:
    assert called() - TARGETS == set()
    wanted = {"test", "paper", "docs", "soak", "combined-faults", "mutants", "dist"}
    assert wanted | {"interop-calls", "test-lowest", "test-newest"} <= called()


def test_the_gate_runs_on_every_python_that_the_package_names() -> None:
    named = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))
    assert WORKFLOWS["test.yml"]["jobs"]["gate"]["strategy"]["matrix"]["python"] == named
    assert PROJECT["requires-python"] == f">={named[0]}"


def test_nothing_may_write_but_the_release() -> None:
    for name, workflow in WORKFLOWS.items():
        assert workflow["permissions"] == {"contents": "read"}, name
        for job in workflow["jobs"].values():
            assert name == "release.yml" or "permissions" not in job


def test_a_release_is_published_without_a_password_and_with_attestations() -> None:
    jobs = WORKFLOWS["release.yml"]["jobs"]
    assert jobs["publish"]["permissions"] == {"id-token": "write"}
    assert jobs["publish"]["needs"] == "build"
    [step] = [step for step in jobs["publish"]["steps"] if "pypi-publish" in step["uses"]]
    assert step["with"] == {"attestations": True}
    assert any("attest-build-provenance" in step.get("uses", "") for step in jobs["build"]["steps"])
    everything = (HOST / "workflows" / "release.yml").read_text(encoding="utf-8")
    assert "secrets." not in everything


def test_a_release_has_links_with_the_repositorys_address_before_it_is_built() -> None:
    lines = lines_of(WORKFLOWS["release.yml"]["jobs"]["build"])
    made = re.findall(r"make ([\w-]+)", "\n".join(lines))
    assert made == ["test", "absolute-links", "dist"]
    # What the target does: the address goes into the table of which docs/front_page.py reads it.
    told = re.search(r"sed -i 's\|(.*?)\|&\\n(.*?)\|'", MAKEFILE)
    assert told
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    line = told[2].replace("$(REPOSITORY)", "https://forge.example/swarm")
    changed = re.sub(told[1].replace("$$", "$"), rf"\g<0>\n{line}", project, flags=re.MULTILINE)
    urls = tomllib.loads(changed)["project"]["urls"]
    assert urls == {**PROJECT["urls"], "Repository": "https://forge.example/swarm"}


def test_version_and_date_are_those_of_the_changelog() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    head = f"## [{PROJECT['version']}] - {cited['date-released']}"
    assert head == re.findall(r"^## \[\d.*$", changelog, re.MULTILINE)[0]
    assert cited["version"] == PROJECT["version"]
