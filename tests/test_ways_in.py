"""Ways to install the package besides pip: each asks for what pyproject.toml asks for."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = yaml.safe_load((ROOT / "packaging" / "recipe" / "recipe.yaml").read_text("utf-8"))
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
BINDER = (ROOT / "binder" / "requirements.txt").read_text(encoding="utf-8")
PYTHONS = [
    classifier.rpartition(" ")[2]
    for classifier in PROJECT["classifiers"]
    if "Python :: 3." in classifier
]


def test_the_conda_recipe_asks_for_what_pip_asks_for() -> None:
    python, *run = RECIPE["requirements"]["run"]
    assert python == f"python {PROJECT['requires-python']}"
    assert [need.replace(" ", "", 1) for need in run] == PROJECT["dependencies"]
    assert RECIPE["context"]["version"] == PROJECT["version"]
    scripts = [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert RECIPE["build"]["python"]["entry_points"] == scripts
    assert RECIPE["about"]["summary"] == PROJECT["description"]
    assert RECIPE["about"]["license"] == PROJECT["license"]


def test_container_and_binder_name_extras_and_pythons_that_there_are() -> None:
    for text in (DOCKERFILE, BINDER):
        [extras] = re.findall(r"\.\[([\w,]+)\]", text)
        assert set(extras.split(",")) <= PROJECT["optional-dependencies"].keys()
    [python] = re.findall(r"^FROM python:([\d.]+)-slim$", DOCKERFILE, re.MULTILINE)
    runtime = (ROOT / "binder" / "runtime.txt").read_text(encoding="utf-8").strip()
    assert {python, runtime.removeprefix("python-")} <= set(PYTHONS)


def test_what_the_container_copies_is_what_it_needs() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8")
    copied = re.findall(r"^!(\S+)$", ignored, re.MULTILINE)
    assert all((ROOT / name).exists() for name in copied)
    needed = {"pyproject.toml", PROJECT["readme"], *PROJECT["license-files"], "constraints.txt"}
    assert needed <= set(copied)


def test_the_command_is_called_as_the_distribution_too() -> None:
    # `uvx NAME` looks for the command NAME in the distribution NAME.
    scripts = PROJECT["scripts"]
    assert scripts[PROJECT["name"]] == scripts["swarm-logistics"]
