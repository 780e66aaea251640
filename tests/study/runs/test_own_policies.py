"""Policies of a user's own in a study: each plays what it is now, and what is the same counts."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.study.studies import Study

pytestmark = pytest.mark.unmeasured

SCALED = """\
from gains import GAIN
from swarm_logistics_env import policies

class Scaled:
    def __init__(self, gain=GAIN): self.gain = gain
    def reset(self, n, seed):
        self.homing = policies.load("homing")
        self.homing.reset(n, seed)
    def act(self, observations): return self.gain * self.homing.act(observations)

def still(): return Scaled(0.0)
def moving(): return Scaled(1.0)
"""


@pytest.fixture
def world(sizes: dict[str, Any]) -> dict[str, Any]:
    """Fields of a study of two conditions that `homing` delivers in."""
    scenario = {**sizes["scenario"], "restock": True, "duration": 30.0}
    return {**sizes, "scenario": scenario, "sizes": [{"values": [2, 4]}], "seeds": 2}


@pytest.fixture
def scaled(tmp_path: Path) -> Path:
    """File of a policy that scales homing's commands, by 1 as `gains.py` beside it has it."""
    (tmp_path / "gains.py").write_text("GAIN = 1.0\n")
    (tmp_path / "mine.py").write_text(SCALED)
    return tmp_path / "mine.py"


def play(world: dict[str, Any], policies: list[Any], out: Path | None, processes: int = 1) -> Any:
    """Return how many runs were played, how many counted, and each policy's deliveries."""
    study = Study(out=out, **world, policies=policies)
    tally = study.run(processes=processes)
    assert tally.failed == 0, tally.error
    delivered = study.results().groupby("policy", sort=False)["delivered"].sum().to_dict()
    return tally.played, tally.kept, delivered, tally.changes


@pytest.mark.daily
@pytest.mark.parametrize("processes", [1, 2])
def test_an_edited_helper_is_played_and_told_and_what_is_the_same_counts(
    world: dict[str, Any], scaled: Path, tmp_path: Path, processes: int
) -> None:
    out, name = tmp_path / "out", f"{scaled}:Scaled"
    played, n_reused, delivered, _ = play(world, [name], out, processes)
    assert (played, n_reused) == (4, 0)
    assert delivered[name] > 0
    assert play(world, [name], out, processes)[:2] == (0, 4)
    scaled.write_text("# A comment.\n" + SCALED)
    assert play(world, [name], out, processes)[:2] == (0, 4)
    (scaled.parent / "gains.py").write_text("GAIN = 0.0\n")
    played, n_reused, delivered, changes = play(world, [name], out, processes)
    assert (played, n_reused, delivered) == (4, 0, {name: 0})
    assert changes == (f"policy {name}: gains.py changed",)
    (scaled.parent / "gains.py").write_text("GAIN = 1.0\n")
    assert play(world, [name], out, processes)[:2] == (0, 4)


@pytest.mark.daily
def test_factories_and_objects_of_one_class_are_what_each_is(
    world: dict[str, Any], scaled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    still, moving = (f"{scaled}:{name}" for name in ("still", "moving"))
    delivered = play(world, [still, moving], tmp_path / "both")[2]
    assert delivered[still] == 0 < delivered[moving]
    monkeypatch.syspath_prepend(tmp_path)
    from mine import Scaled  # type: ignore[import-not-found]

    objects = [PolicySpec(name=f"{gain:g}", made=Scaled(gain)) for gain in (0.0, 1.0)]
    assert play(world, objects, None)[2] == {"0": 0, "1": delivered[moving]}
    for gain in (0.0, 1.0):
        played, _, made, _ = play(world, [Scaled(gain)], tmp_path / "one by one")
        assert (played, made["Scaled"] > 0) == (4, gain > 0)
    # A class of this test's own: in two processes it travels as it is.

    class Halting(Scaled):  # type: ignore[misc]
        def act(self, observations: Any) -> Any:
            return 0.0 * super().act(observations)

    assert play(world, [Halting()], None, processes=2)[2] == {"Halting": 0}
    assert Study(**world, policies=[Scaled(0.0)]).plan().runs[0].key == (
        Study(**world, policies=[Scaled(0.0)]).plan().runs[0].key
    )


def test_a_policy_file_that_is_overwritten_is_read_again(
    world: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = {name: WEIGHTS / f"{name}.safetensors" for name in ("ppo-delivery", "ppo-robust")}
    expected = {
        name: Study(**world, policies=[name]).plan().runs[0].play().digest for name in files
    }
    played = {}
    for name, file in files.items():  # one file, overwritten
        shutil.copy(file, tmp_path / "best.safetensors")
        study = Study(**world, policies=[str(tmp_path / "best.safetensors")])
        played[name] = study.plan().runs[0].play().digest
    assert played == expected
    for name, file in files.items():  # one relative path, in two folders
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        shutil.copy(file, "best.safetensors")
        study = Study(**world, policies=["best.safetensors"])
        assert study.plan().runs[0].play().digest == expected[name]
    for number in range(1, 4):
        shutil.copy(files["ppo-robust"], tmp_path / f"r@{number}.safetensors")
        if number > 1:
            recipe = PolicySpec.of(str(tmp_path / "r@all.safetensors"))
            assert len(recipe.trainings) == number


@pytest.mark.parametrize("processes", [1, 2])
def test_what_changes_after_the_plan_is_never_played_under_the_old_identity(
    world: dict[str, Any], scaled: Path, processes: int
) -> None:
    study = Study(**world, policies=[f"{scaled}:Scaled"])
    runs = study.plan().runs
    assert runs[0].play().error is None
    (scaled.parent / "gains.py").write_text("GAIN = 0.0\n")
    with pytest.raises(PolicyError, match=r"is not what was planned: gains\.py changed"):
        study.run(processes=processes)
    # A worker that begins only now would import the new file.
    from swarm_logistics_env.policies import spec

    spec._planned_policies.clear()
    assert "gains.py changed" in str(runs[0].play().error)


def test_an_object_that_changes_after_the_plan_is_refused(world: dict[str, Any]) -> None:
    class Mine:
        gain = 1.0

        def reset(self, n_robots: int, seed: int) -> None: ...
        def act(self, observations: Any) -> Any:
            return 0.0 * observations[:, :4] * self.gain

    policy = Mine()
    study = Study(**world, policies=[policy])
    study.plan()
    policy.gain = 2.0
    with pytest.raises(PolicyError, match="is not what was planned"):
        study.run()


def test_what_is_another_one_each_time_is_played_again_and_told(
    world: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "dice.py").write_text(
        "import numpy as np\nclass Dice:\n"
        "    def __init__(self): self.rng = np.random.default_rng()\n"
        "    def reset(self, n, seed): self.rng = np.random.default_rng(seed)\n"
        "    def act(self, o): return self.rng.uniform(-1, 1, (len(o), 4))\n"
    )
    name, out = f"{tmp_path}/dice.py:Dice", tmp_path / "out"
    assert play(world, [name], out, processes=2)[:2] == (4, 0)
    played, n_reused, _, changes = play(world, [name], out)
    assert (played, n_reused) == (4, 0)
    assert "is another one each time it is made" in changes[0]


CELL = """
import sys
from swarm_logistics_env.study.studies import Study

world = dict(seeds=2, scenario=dict(duration=5.0, n_robots=3), sizes=[dict(values=[2, 3])])
for speed in (0.5, 1.0, 1.0):
    # As a notebook's cell that is edited and executed again.
    exec(f'''
class Mine:
    def reset(self, n, seed): pass
    def act(self, observations):
        commands = 0.0 * observations[:, :4]
        commands[:, 0] = {speed}
        return commands
''')
    study = Study(out="out", policies=[Mine()], **world)
    tally = study.run(processes=int(sys.argv[1]))
    print(tally.played, tally.kept, tally.failed, *tally.changes)
"""


@pytest.mark.daily
@pytest.mark.parametrize("processes", ["1", "2"])
def test_an_edited_cell_is_played_from_standard_input_without_a_guard(
    tmp_path: Path, processes: str
) -> None:
    done = subprocess.run(
        [sys.executable, "-", processes],
        input=textwrap.dedent(CELL),
        cwd=tmp_path,
        env={**os.environ, "PYTHONHASHSEED": "random"},
        capture_output=True,
        text=True,
        check=False,
    )
    change = "policy Mine: its parameters, attributes or functions changed"
    assert done.stdout.splitlines() == ["4 0 0", f"4 0 0 {change}", "0 4 0"], done.stderr


def test_two_objects_of_one_name_are_refused(world: dict[str, Any]) -> None:
    class Mine:
        def reset(self, n_robots: int, seed: int) -> None: ...
        def act(self, observations: Any) -> Any: ...

    with pytest.raises(StudyError, match="Mine"):
        Study(**world, policies=[Mine(), Mine()]).plan()
