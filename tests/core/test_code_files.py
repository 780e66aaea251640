from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import cloudpickle
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env.core.code_files import import_file, is_users_own
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies import load

MINE = """import queue
from gains import GAIN
class Mine:
    gain = GAIN
    def reset(self, n_robots, seed): pass
    def act(self, observations):
        import late
        return late.LATE
"""


def write(folder: Path, number: int) -> Path:
    """Write a policy with two neighbours into a folder; return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "gains.py").write_text(f"GAIN = {number}\n")
    (folder / "late.py").write_text(f"import gains\nLATE = ({number}, gains.GAIN)\n")
    (folder / "mine.py").write_text(MINE)
    return folder / "mine.py"


def test_files_of_one_name_have_their_own_neighbours_whenever_they_import(tmp_path: Path) -> None:
    before = {name for name in sys.modules if "@" not in name}, [*sys.path], [*sys.meta_path]
    policies = [load(f"{write(tmp_path / str(number), number)}:Mine") for number in range(3)]
    assert [policy.gain for policy in policies] == [0, 1, 2]  # type: ignore[attr-defined]
    # Imported only now, in another order, and from each folder.
    for number in (2, 0, 1, 2):
        assert policies[number].act(None) == (number, number)  # type: ignore[arg-type]
    after = {name for name in sys.modules if "@" not in name}, [*sys.path], [*sys.meta_path]
    assert after == before


def test_modules_are_kept_apart_and_executed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stranger = ModuleType("gains")
    monkeypatch.setitem(sys.modules, "gains", stranger)
    (tmp_path / "gains.py").write_text("GAIN = [0]\n")
    (tmp_path / "mine.py").write_text(
        "import gains\nclass Mine:\n    def reset(self, n, seed): gains.GAIN[0] += 1\n"
        "    def act(self, observations):\n        from gains import GAIN\n        return GAIN[0]\n"
    )
    policy = load(f"{tmp_path}/mine.py:Mine")
    for _ in range(3):
        policy.reset(1, 0)
    assert policy.act(None) == 3  # type: ignore[arg-type]
    assert sys.modules["gains"] is stranger


IMPORTS = {
    "from": "from importlib import import_module",
    "whole": "import importlib.util as util, importlib\nimport_module = importlib.import_module",
    "function": "def import_module(name): return __import__(name)",
}


@pytest.mark.parametrize("imports", IMPORTS.values(), ids=IMPORTS.keys())
def test_a_neighbour_that_is_imported_by_a_call_is_that_of_the_folder(
    tmp_path: Path, imports: str
) -> None:
    policies = []
    modules = {name: sys.modules.get(name) for name in ("gains", "late")}
    for number in (1, 2):
        path = write(tmp_path / str(number), number)
        path.write_text(
            f"{imports}\nGAIN = import_module('gains').GAIN\nclass Mine:\n    gain = GAIN\n"
            "    def reset(self, n_robots, seed): pass\n"
            "    def act(self, observations): return import_module('late').LATE\n"
        )
        policies.append(load(f"{path}:Mine"))
    for number, policy in enumerate(policies, start=1):
        assert policy.gain == number  # type: ignore[attr-defined]
        assert policy.act(None) == (number, number)  # type: ignore[arg-type]
    assert {name: sys.modules.get(name) for name in modules} == modules


def test_packages_of_another_environment_are_no_code_of_the_users(tmp_path: Path) -> None:
    assert is_users_own(str(tmp_path / "mine.py"))
    assert is_users_own(None)
    for folder in ("lib/python3/dist-packages", "other/site-packages"):
        assert not is_users_own(str(tmp_path / folder / "numpy" / "core.py"))
    assert not is_users_own(np.__file__)
    assert not is_users_own(os.__file__)


@pytest.mark.unmeasured
@given(st.permutations(["v1", "v2", "v1/deep", "."]))
def test_a_path_is_its_file_in_any_order(
    tmp_path_factory: pytest.TempPathFactory, order: list[str]
) -> None:
    root = tmp_path_factory.getbasetemp() / "orders"
    numbers = {"v1": 1, "v2": 2, "v1/deep": 3, ".": 4}
    for name in order:
        path = root / name / "mine.py"
        if not path.exists():
            write(root / name, numbers[name])
        assert load(f"{path}:Mine").gain == numbers[name]  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["test", "queue", "numpy", "random", "my-own", "v1.2", "json"])
def test_a_file_may_have_the_name_of_any_module(tmp_path: Path, name: str) -> None:
    before = sys.modules.get(name)
    write(tmp_path, 7).rename(tmp_path / f"{name}.py")
    assert load(f"{tmp_path / name}.py:Mine").gain == 7  # type: ignore[attr-defined]
    assert sys.modules.get(name) is before


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    write(tmp_path / "v1", 1)
    load(f"{tmp_path}/v1/mine.py:Mine")
    with pytest.raises(PolicyError, match=r"there is no file .*v2"):
        load(f"{tmp_path}/v2/mine.py:Mine")


@pytest.mark.parametrize("changed", ["mine", "gains", "late"])
def test_a_changed_file_or_neighbour_is_executed_again(tmp_path: Path, changed: str) -> None:
    path = write(tmp_path, 1)
    module = import_file(path)
    assert module.Mine().act(None) == (1, 1)
    assert import_file(path) is module
    file = tmp_path / f"{changed}.py"
    status = file.stat()
    file.write_text(file.read_text().replace("1", "2").replace("GAIN\n    def", "222\n    def"))
    os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))  # as files of equal age and size
    policy = import_file(path).Mine()
    assert (policy.gain, *policy.act(None)) == {
        "mine": (222, 1, 1), "gains": (2, 1, 2), "late": (1, 2, 1)
    }[changed]  # fmt: skip


def test_a_file_of_a_package_finds_it(tmp_path: Path) -> None:
    package = tmp_path / "kit"
    (package / "parts").mkdir(parents=True)
    for name, text in {
        "__init__": "KIT = 1\n",
        "parts/__init__": "",
        "parts/arm": "from .. import KIT\nfrom kit.base import BASE\nARM = KIT + BASE\n",
        "base": "import beside\nBASE = beside.X\n",
        "mine": "from . import parts\nfrom .parts.arm import ARM\nclass Mine:\n    gain = ARM\n"
        "    def reset(self, n, s): pass\n    def act(self, o):\n        import kit.base as b\n"
        "        return b.BASE\n",
        "../beside": "X = 10\n",
    }.items():
        (package / f"{name}.py").write_text(text)
    policy = load(f"{package}/mine.py:Mine")
    assert (policy.gain, policy.act(None)) == (11, 10)  # type: ignore[attr-defined, comparison-overlap, arg-type]
    assert not {"kit", "beside"} & sys.modules.keys()


def test_installed_modules_do_not_see_the_folder(tmp_path: Path) -> None:
    """A file beside the policy that is called as a module which pandas looks for is not run."""
    write(tmp_path, 1)
    (tmp_path / "pyarrow.py").write_text("raise SystemExit('it was run')\n")
    (tmp_path / "mine.py").write_text("import pandas\n" + MINE)
    script = (
        "import sys; from swarm_logistics_env import policies; "
        "print(policies.load(f'{sys.argv[1]}/mine.py:Mine').gain)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        cwd=tmp_path.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "1\n"


def test_a_policy_of_a_file_goes_to_another_process(tmp_path: Path) -> None:
    policy = load(f"{write(tmp_path, 5)}:Mine")
    (tmp_path / "sent").write_bytes(cloudpickle.dumps(policy))
    script = "import pickle, sys; print(pickle.load(open(sys.argv[1], 'rb')).gain)"
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "sent")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == "5\n"
    assert pickle.loads(cloudpickle.dumps(policy)).gain == 5
