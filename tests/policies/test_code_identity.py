from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import swarm_logistics_env
from swarm_logistics_env import Scenario, run_episode
from swarm_logistics_env.policies import SwarmDT, identity, load
from swarm_logistics_env.policies.policy import code_digest

PACKAGE = Path(swarm_logistics_env.__file__).parent

# Reads changes (file, old text, new text), and prints the policies that each gave another digest.
SCRIPT = """
import json, sys
from pathlib import Path
import swarm_logistics_env
from swarm_logistics_env.policies.central import Central
from swarm_logistics_env.policies.policy import code_digest
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.learned import LearnedPolicy
from swarm_logistics_env.policies.swarm_dt import SwarmDT

def digests():
    code_digest.cache_clear()
    return {kind.__name__: code_digest(kind) for kind in (Central, Homing, LearnedPolicy, SwarmDT)}

package, before, answers = Path(swarm_logistics_env.__file__).parent, digests(), []
for name, old, new in json.load(sys.stdin):
    file = package / name
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    assert old in text, (name, old)
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    answers.append([kind for kind, digest in digests().items() if digest != before[kind]])
    file.write_text(text, encoding="utf-8")
print(json.dumps([before, answers]))
"""


def test_identity_changes_with_the_parameters_and_the_class(own_module: Path) -> None:
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


def test_identity_is_the_same_in_every_process_and_follows_the_source(own_module: Path) -> None:
    def told(hash_seed: str) -> list[str]:
        code = (
            "from swarm_logistics_env.policies import identity, load\n"
            "print(identity(load('swarm-dt-follow', drop_rate=2.0)))\n"
            "print(identity(load('own_policies:Still')))"
        )
        environment = {
            **os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(own_module.parent)
        }  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.splitlines()

    first = told("1")
    assert first[0] == identity(load("swarm-dt-follow", drop_rate=2.0))
    assert first[1] == identity(load("own_policies:Still"))
    assert json.loads(first[0])["parameters"]["heading_follows"] is True
    own_module.write_text(own_module.read_text() + "\nmore = 8\n")
    second = told("2")
    assert second[0] == first[0]
    assert second[1] != first[1]


def test_only_code_that_a_policy_uses_changes_its_identity(tmp_path: Path) -> None:
    everybody = ["Central", "Homing", "LearnedPolicy", "SwarmDT"]
    expected = {
        ("policies/another.py", "", "GAIN = 1.0\n"): [],
        ("policies/spec.py", "SCRIPTED: dict", "MORE = 1\nSCRIPTED: dict"): [],
        ("policies/swarm_dt.py", "# It turns towards", "# Turns towards"): [],
        ("errors.py", "class ", "MORE = 1\n\n\nclass "): [],
        ("policies/swarm_dt.py", "2.0 * drawn - 1.0", "1.9 * drawn - 1.0"): ["SwarmDT"],
        ("policies/routes.py", "1e-9", "1e-8"): ["Central"],
        ("motion/memory.py", "STANDS = 0.2", "STANDS = 0.3"): ["Homing", "LearnedPolicy"],
        ("kernels.py", "2.0 * math.pi", "6.28"): everybody,
    }
    copy = tmp_path / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        input=json.dumps([*expected]),
        capture_output=True,
        text=True,
        check=True,
    )
    before, answers = json.loads(done.stdout)
    assert before["SwarmDT"] == code_digest(SwarmDT)
    assert len(set(before.values())) == len(everybody)
    assert answers == [*expected.values()]


def test_identity_of_a_policy_in_a_package_follows_what_it_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "own_package"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "gains.py").write_text("GAIN = 1.0\n")
    (folder / "unused.py").write_text("GAIN = 1.0\n")
    (folder / "mine.py").write_text(
        "from swarm_logistics_env.policies.swarm_dt import SwarmDT\nfrom .gains import GAIN\n"
        "class Mine(SwarmDT):\n    gain = GAIN\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    first = identity(load("own_package.mine:Mine"))
    code_digest.cache_clear()
    (folder / "unused.py").write_text("GAIN = 2.0\n")
    assert identity(load("own_package.mine:Mine")) == first
    code_digest.cache_clear()
    (folder / "gains.py").write_text("GAIN = 2.0\n")
    assert identity(load("own_package.mine:Mine")) != first
