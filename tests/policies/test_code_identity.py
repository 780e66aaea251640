from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import swarm_logistics_env
from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.policies import SwarmDT, identity, load
from swarm_logistics_env.policies.central import Central
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.learned import LearnedPolicy
from swarm_logistics_env.policies.policy import code_digest


def test_identity_changes_with_the_parameters_and_the_class_alone(own_module: Path) -> None:
    identities = [
        identity(load("swarm-dt")),
        identity(load("swarm-dt", taxis_gain=0.5)),
        identity(load("swarm-dt-follow")),
        identity(load("random-walk")),
        identity(load("own_policies:Still")),
        identity(load("own_policies:Still", gripper=0.5)),
        identity(load("own_policies:Named")),
    ]
    assert len(set(identities)) == len(identities)
    assert identities[-1] == "weights 1"
    used = load("swarm-dt", taxis_gain=0.75)
    run_episode(Scenario(n_robots=2, duration=1.0), used, seed=3)
    assert identity(used) == identities[0]
    script = (
        "from swarm_logistics_env.policies import identity, load\n"
        "for name in ('swarm-dt', 'own_policies:Still'): print(identity(load(name)))"
    )
    for hash_seed in ("1", "2"):
        elsewhere = subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "PYTHONPATH": str(own_module.parent), "PYTHONHASHSEED": hash_seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert elsewhere.stdout.splitlines() == [identities[0], identities[4]]


EVERYBODY = [Central, Homing, LearnedPolicy, SwarmDT]


@pytest.mark.parametrize(
    ("name", "old", "new", "changed"),
    [
        ("policies/spec.py", "SCRIPTED: dict", "MORE = 1\nSCRIPTED: dict", []),
        ("policies/swarm_dt.py", "# It turns towards", "# Turns towards", []),
        ("errors.py", "class ", "MORE = 1\n\n\nclass ", []),
        ("policies/swarm_dt.py", "2.0 * drawn - 1.0", "1.9 * drawn - 1.0", [SwarmDT]),
        ("policies/routes.py", "1e-9", "1e-8", [Central]),
        ("motion/memory.py", "STANDS = 0.2", "STANDS = 0.3", [Homing, LearnedPolicy]),
        ("kernels.py", "2.0 * math.pi", "6.28", EVERYBODY),
    ],
)
def test_only_code_that_a_policy_uses_changes_its_identity(
    monkeypatch: pytest.MonkeyPatch, name: str, old: str, new: str, changed: list[type]
) -> None:
    file, read = Path(swarm_logistics_env.__file__).parent / name, Path.read_bytes
    assert old in file.read_text()

    def read_changed(path: Path) -> bytes:
        content = read(path)
        return content.replace(old.encode(), new.encode(), 1) if path == file else content

    monkeypatch.setattr(Path, "read_bytes", read_changed)
    told = {kind: code_digest.__wrapped__(kind) for kind in EVERYBODY}  # which keeps no answer
    assert len(set(told.values())) == len(EVERYBODY)
    monkeypatch.undo()
    assert [kind for kind, digest in told.items() if digest != code_digest(kind)] == changed


def test_identity_of_a_policy_in_a_package_follows_what_it_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "own_package"
    folder.mkdir()
    for name in ("__init__", "gains", "unused"):
        (folder / f"{name}.py").write_text("GAIN = 1.0\n")
    (folder / "mine.py").write_text(
        "from swarm_logistics_env.policies.swarm_dt import SwarmDT\nfrom .gains import GAIN\n"
        "class Mine(SwarmDT):\n    gain = GAIN\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    first = identity(load("own_package.mine:Mine"))
    for name, is_used in (("unused", False), ("gains", True)):
        (folder / f"{name}.py").write_text("GAIN = 2.0\n")
        code_digest.cache_clear()
        assert (identity(load("own_package.mine:Mine")) != first) == is_used
