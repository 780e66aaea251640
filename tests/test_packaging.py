"""What a user installs: the package with its data, and nothing else at the top level."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from typing import NamedTuple

import pytest

PACKAGE = "swarm_logistics_env"
ROOT = Path(__file__).parents[1]

# One worker builds once for the whole file.
pytestmark = pytest.mark.xdist_group("packaging")


class Built(NamedTuple):
    """Names of the files in each distribution, relative to its root."""

    sdist: set[str]
    wheel: set[str]


def package_files() -> set[str]:
    """Every file of the package in the working tree that is no cache."""
    return {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / PACKAGE).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def environments_and_output(folder: str, names: list[str]) -> set[str]:
    """What a copy of the tree leaves out, in the form `shutil.copytree` asks for."""
    at_top = {"build", "dist", "results"} if Path(folder) == ROOT else set()
    hidden = {n for n in names if n.startswith(".")} - {".github"}
    return hidden | {n for n in names if n in at_top or n.endswith(".egg-info")}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Builds the sdist from a copy of the tree and the wheel from that sdist, as pip would."""
    copy = tmp_path_factory.mktemp("tree") / "source"
    out = tmp_path_factory.mktemp("dist")
    shutil.copytree(ROOT, copy, symlinks=True, ignore=environments_and_output)
    # The build is not isolated: the dev extra holds setuptools, so it needs no network.
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(copy)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    [sdist] = out.glob("*.tar.gz")
    [wheel] = out.glob("*.whl")
    with tarfile.open(sdist) as archive:
        in_sdist = {m.name.partition("/")[2] for m in archive.getmembers() if m.isfile()}
    with zipfile.ZipFile(wheel) as archive:
        return Built(in_sdist, set(archive.namelist()))


def top_level(names: set[str]) -> set[str]:
    return {name.partition("/")[0] for name in names}


def test_wheel_holds_the_package_alone(built: Built) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert top_level(built.wheel) == {PACKAGE, f"{PACKAGE}-{version}.dist-info"}


def test_wheel_and_sdist_hold_every_file_of_the_package(built: Built) -> None:
    expected = package_files()
    assert f"{PACKAGE}/py.typed" in expected
    assert {name for name in built.wheel if name.startswith(f"{PACKAGE}/")} == expected
    assert {name for name in built.sdist if name.startswith(f"{PACKAGE}/")} == expected


def test_sdist_is_enough_to_run_the_gate(built: Built) -> None:
    assert {"Makefile", "constraints.txt", "pyproject.toml", "LICENSE"} <= built.sdist
    assert {
        "SECURITY.md",
        "CITATION.cff",
        "CHANGELOG.md",
        ".github/workflows/test.yml",
    } <= built.sdist
    tests = {path.relative_to(ROOT).as_posix() for path in (ROOT / "tests").rglob("*.py")}
    assert tests <= built.sdist


def test_links_at_the_top_show_parts_of_the_package() -> None:
    links = [path for path in ROOT.iterdir() if path.is_symlink()]  # a checkout may have none
    assert {path.name for path in links} <= {"policies", "train"}
    assert [path.resolve() for path in links] == [ROOT / PACKAGE / path.name for path in links]
