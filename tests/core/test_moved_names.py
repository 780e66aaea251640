"""Former names of modules go on working, with a warning, and are not second copies."""

from __future__ import annotations

import importlib
import runpy
import subprocess
import sys

import pytest

import swarm_logistics_env
from swarm_logistics_env import adapters, spi
from swarm_logistics_env.core import errors
from swarm_logistics_env.core.moved_names import MOVED, PACKAGE, install, name_today


@pytest.fixture(autouse=True)
def _forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let each test import former names for the first time, and forget them afterwards."""
    for name in [name for name in sys.modules if name_today(name)]:
        monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize("former_name", MOVED)
def test_a_former_name_is_what_it_is_called_today_with_a_warning(former_name: str) -> None:
    module, _, attribute = f"{PACKAGE}.{former_name}".rpartition(".")
    message = f"{former_name} is now {PACKAGE}.{MOVED[former_name]}"
    with pytest.warns(DeprecationWarning, match=message):
        # What the package still offers is a former name of a module alone.
        former = (
            importlib.import_module(f"{PACKAGE}.{former_name}")
            if former_name in swarm_logistics_env.__all__
            else getattr(importlib.import_module(module), attribute)
        )
    holder, _, name = f"{PACKAGE}.{MOVED[former_name]}".rpartition(".")
    assert former is getattr(importlib.import_module(holder), name)


def test_who_uses_a_former_name_is_named_in_the_warning() -> None:
    sentence = f"^{PACKAGE}.errors is now {PACKAGE}.core.errors$"
    with pytest.warns(DeprecationWarning, match=sentence) as warnings:
        assert swarm_logistics_env.errors is errors
    assert [warning.filename for warning in warnings] == [__file__]


def test_former_names_are_found_by_one_finder_before_all_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    finders = [finder for finder in sys.meta_path if type(finder).__name__ != "_FormerNames"]
    monkeypatch.setattr(sys, "meta_path", [*finders])
    for _ in range(2):
        install()
    first, *further = sys.meta_path
    assert (type(first).__name__, further) == ("_FormerNames", finders)


@pytest.mark.parametrize(
    ("name", "today"),
    [
        (f"{PACKAGE}.warehouse", f"{PACKAGE}.world.warehouse"),
        (f"{PACKAGE}.warehouse.faults.Fault", f"{PACKAGE}.world.warehouse.faults.Fault"),
        (f"{PACKAGE}.world.warehouse", None),
        (PACKAGE, None),
        ("other.warehouse", None),
    ],
)
def test_a_name_of_today_is_that_of_the_longest_part_that_moved(
    name: str, today: str | None
) -> None:
    assert name_today(name) == today


def test_what_lies_under_a_former_name_is_no_second_copy() -> None:
    from swarm_logistics_env.world.warehouse.faults import Fault

    with pytest.warns(DeprecationWarning, match="warehouse"):
        module = importlib.import_module("swarm_logistics_env.warehouse.faults")
    assert module.Fault is Fault
    assert module.__spec__ is not None
    assert module.__spec__.name == "swarm_logistics_env.world.warehouse.faults"


def test_what_never_was_is_an_attribute_error() -> None:
    for module in (swarm_logistics_env, spi):
        assert not hasattr(module, "no_such_name")
    with pytest.warns(DeprecationWarning, match="warehouse"), pytest.raises(ModuleNotFoundError):
        importlib.import_module("swarm_logistics_env.warehouse.no_such_name")


def test_a_module_runs_under_its_former_name_as_python_m_runs_it() -> None:
    members = runpy.run_module(f"{PACKAGE}.errors")
    assert members["suggest"]("homin", ["homing"]) == "; did you mean 'homing'?"


def test_the_package_lists_what_it_offers() -> None:
    assert set(dir(swarm_logistics_env)) == {*swarm_logistics_env.__all__, "__version__"}
    assert dir(adapters) == sorted(adapters.__all__)


@pytest.mark.daily
def test_the_command_line_starts_under_its_former_name() -> None:
    command = [sys.executable, "-m", "swarm_logistics_env.cli", "--help"]
    assert "judge" in subprocess.run(command, capture_output=True, text=True, check=True).stdout
