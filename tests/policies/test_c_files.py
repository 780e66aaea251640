"""Controllers in C as policies."""

from __future__ import annotations

import copy
import pickle
import runpy
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.policies import PolicySpec, c_compiler
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.world import observations as row

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "wanderer.c"
needs_compiler = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="needs a C compiler"
)

# Counts its steps and tells what it was told.
COUNTING = """\
#include "limits.h"
typedef struct { float count; float number; float seed; } swarm_robot;
void swarm_reset(swarm_robot *robot, unsigned long long seed, unsigned number) {
    robot->number = (float)number;
    robot->seed = (float)(seed % 1000) / 1000.0f;
}
void swarm_step(swarm_robot *robot, const float row[141], float command[4]) {
    robot->count += 1.0f;
    command[0] = robot->count / MOST;
    command[1] = robot->number / MOST;
    command[2] = robot->seed;
    command[3] = row[140];
}
"""


@pytest.fixture
def counting(tmp_path: Path) -> str:
    (tmp_path / "limits.h").write_text("#define MOST 100.0f\n")
    (tmp_path / "counting.c").write_text(COUNTING)
    return f"c:{tmp_path / 'counting.c'}"


def rows(n_robots: int, value: float = 0.0) -> Any:
    return np.full((n_robots, row.N_COLUMNS), value, np.float32)


@needs_compiler
def test_the_example_does_what_the_same_controller_does_in_python() -> None:
    scenario = Scenario(n_robots=6, duration=20.0)
    in_c = policies.load(f"c:{EXAMPLE}")
    in_python: Any = runpy.run_path(str(EXAMPLE.with_suffix(".py")))["Wanderer"]()
    in_python.reset(6, 0)
    in_c.reset(6, 0)
    world = Warehouse(scenario)
    observations = world.reset(0)
    while not world.is_over_time:
        commands = in_c.act(observations)
        np.testing.assert_allclose(commands, in_python.act(observations), rtol=0, atol=1e-6)
        observations = world.step(commands)


@needs_compiler
def test_each_robot_keeps_what_it_keeps_and_a_copy_goes_on_by_itself(counting: str) -> None:
    policy = policies.load(counting)
    policy.reset(3, 5)
    first = policy.act(rows(3, 0.25))
    np.testing.assert_allclose(first[:, :2], [[0.01, 0.0], [0.01, 0.01], [0.01, 0.02]])
    assert len({*first[:, 2]}) == 1  # all hear the seed's bits
    assert (first[:, 3] == 0.25).all()
    copies = [copy.deepcopy(policy), pickle.loads(pickle.dumps(policy))]
    second = policy.act(rows(3))
    for other in copies:
        np.testing.assert_array_equal(other.act(rows(3)), second)
    policy.reset(3, 5)
    np.testing.assert_array_equal(policy.act(rows(3, 0.25)), first)
    policy.reset(3, 6)
    assert policy.act(rows(3))[0, 2] != first[0, 2]
    with pytest.raises(PolicyError, match="observations of 2 robots: reset was told 3"):
        policy.act(rows(2))


@needs_compiler
def test_its_identity_is_its_content_wherever_it_lies(counting: str, tmp_path: Path) -> None:
    before = PolicySpec.of(counting).identity()
    elsewhere = tmp_path / "folder"
    elsewhere.mkdir()
    for name in ("counting.c", "limits.h"):
        shutil.copy(tmp_path / name, elsewhere)
    assert PolicySpec.of(f"c:{elsewhere / 'counting.c'}").identity() == before
    spec = PolicySpec.of(counting)
    (tmp_path / "limits.h").write_text("#define MOST 50.0f\n")
    with pytest.raises(PolicyError, match=r"limits\.h changed; start the study anew"):
        spec.load(planned=before)


@needs_compiler
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("*(volatile int *)0 = 1;", "its program ended amid a step \\(Segmentation fault\\)"),
        ("extern void exit(int); exit(3);", "its program ended amid a step \\(exit status 3\\)"),
        ("command[0] = row[0] / 0.0f;", "CFile at 0 s: .* finite"),
        ("this is no C", r"crash\.c cannot be compiled:(?s:.*)error:"),
        ("#define SWARM_PERIOD 0.5f", "SWARM_PERIOD is 0.5 s: should be .* control_period, 0.1 s"),
        ("#define SWARM_ROW 149", "SWARM_ROW is 149: should be at most 141"),
    ],
)
def test_what_is_wrong_with_a_file_is_an_error_of_its_policy(
    line: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "crash.c"
    path.write_text(
        "typedef struct { int count; } swarm_robot;\n"
        "void swarm_reset(swarm_robot *robot, unsigned long long seed, unsigned number) {}\n"
        "void swarm_step(swarm_robot *robot, const float *row, float *command) {\n"
        f"{line}\n}}\n"
    )
    with pytest.raises(PolicyError, match=message):
        run_episode(Scenario(n_robots=2, duration=1.0), policies.load(f"c:{path}"), 0)


@needs_compiler
def test_what_a_controller_prints_is_none_of_its_commands(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "talking.cpp"  # C++ does as well
    path.write_text(
        "#include <cstdio>\n#include <cstdint>\n"
        "struct swarm_robot { int count = 0; };\n"
        'void swarm_reset(swarm_robot *, uint64_t, uint32_t) { std::puts("begins"); }\n'
        "void swarm_step(swarm_robot *, const float *, float *command) { command[3] = 1.0f; }\n"
    )
    if not shutil.which("c++"):
        pytest.skip("needs a C++ compiler")
    policy = policies.load(f"c:{path}")
    policy.reset(2, 0)
    assert policy.act(rows(2)).tolist() == [[0.0, 0.0, 0.0, 1.0]] * 2
    assert capfd.readouterr().out == ""


def test_a_system_without_a_compiler_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for variable in ("CC", "CXX"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(PolicyError, match=r"there is no compiler .* apt install gcc"):
        policies.load(f"c:{EXAMPLE}")
    with pytest.raises(PolicyError, match=r"cannot read missing\.c: No such file"):
        policies.load("c:missing.c")


@needs_compiler
def test_a_program_that_no_cache_can_hold_is_compiled_for_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    no_folder = tmp_path / "file"
    no_folder.touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(no_folder))
    monkeypatch.setattr(c_compiler, "_cache", c_compiler._cache.__wrapped__)
    program = c_compiler.compiled_controller(EXAMPLE)
    assert program.parent.name.startswith("swarm-logistics-")
    assert [*program.parent.iterdir()] == [program]
    monkeypatch.setattr(c_compiler, "_cache", lambda: program.parent)
    policy = policies.load(f"c:{EXAMPLE}")
    policy.reset(2, 0)
    assert policy.act(rows(2)).shape == (2, 4)


def test_a_file_of_another_language_is_refused() -> None:
    with pytest.raises(PolicyError, match=r"wanderer\.py: should end in \.c or \.cpp$"):
        c_compiler.compiled_controller(EXAMPLE.with_suffix(".py"))


@needs_compiler
def test_a_study_plays_one_and_a_file_of_a_study_needs_trust(
    sizes: dict[str, Any], tmp_path: Path
) -> None:
    study = Study(out=tmp_path / "out", **{**sizes, "policies": [f"c:{EXAMPLE}"], "ablations": []})
    assert study.run().failed == 0
    file = tmp_path / "study.toml"
    file.write_text(f'name = "s"\nseeds = 2\npolicies = ["c:{EXAMPLE}"]\n')
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        Study.from_file(file)
    Study.from_file(file, trust_code=True)
