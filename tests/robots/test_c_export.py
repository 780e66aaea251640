"""Policies as C: the file commands what the policy commands, without a warning or a fault."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.c_files import CFile
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import Network, PolicyCard, tensor_shapes
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.robots import c_sizes
from swarm_logistics_env.robots.c_export import write_c
from swarm_logistics_env.robots.c_sizes import compiler_for_cortex_m4, sizes_of
from swarm_logistics_env.world.motion.memory import N_COLUMNS

Commands: TypeAlias = NDArray[np.float64]
NAMES = ("homing", "homing-stock", "swarm-dt", "ppo-robust")
# Robots on wheels, and lifting takes time: all that the kernels do.
SCENARIO = Scenario.preset("realistic").replace(restock=True)
FUZZ = Path(__file__).parent / "fuzz.c"
EXACT = 1e-5  # of a command
ROUNDED = 1e-2  # more is a decision on the other side of a branch
needs_gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="needs gcc")


@dataclass
class Replay:
    """Rows of episodes, decided in Python and in C.

    Attributes:
        n_decisions: of single robots.
        n_unequal: commands that differ by a bit or more.
        n_rounded: commands that differ by more than `EXACT`: those of `float`, seen enlarged, as
            in the turn of a robot that hardly drives.
        n_elsewhere: those that differ by more than `ROUNDED`.
        worst: the most that the velocity of another decision differs by [mm/s].
    """

    n_decisions: int = 0
    n_unequal: int = 0
    n_rounded: int = 0
    n_elsewhere: int = 0
    worst: float = 0.0


def c_files(name: str, scenario: Scenario, folder: Path) -> tuple[Path, Path]:
    """Write a policy in C; return the files of both precisions, `float` and `double`."""
    files = write_c(policies.load(name), scenario, folder / "robot.c")
    in_double = folder / "double.c"
    in_double.write_text('#define SWARM_DOUBLE\n#include "robot.c"\n')
    return files.source, in_double


def replay(name: str, scenario: Scenario, seeds: range, folder: Path) -> list[Replay]:
    """Play episodes with the policy; upon each row, the C file decides as well, in both precisions.

    A robot whose commands differ goes on from what the policy remembers: else a heading that is
    off would be counted at every decision to come.

    Returns:
        What `float` and what `double` did.
    """
    in_float, in_double = c_files(name, scenario, folder)
    policy: Any = policies.load(name)
    controllers: list[Any] = [policies.load(f"c:{path}") for path in (in_float, in_double)]
    counts = [Replay(), Replay()]
    for seed in seeds:
        world = Warehouse(scenario)
        rows = world.reset(seed)
        for player in (policy, *controllers):
            start(player, scenario, seed)
        while not world.is_over_time:
            commands = policy.act(rows)
            for controller, count in zip(controllers, counts, strict=True):
                commands_in_c = controller.act(rows)
                compare(commands, commands_in_c, scenario, count)
                differs = np.abs(commands - commands_in_c).max(axis=1) > EXACT
                if differs.any():
                    take_over(policy, controller, np.flatnonzero(differs))
            rows = world.step(commands)
    return counts


def paths(policy: Any, fault: str) -> NDArray[np.float64]:
    """Return where all robots are after each of 200 steps (200, N, 2) [m]."""
    world = Warehouse(SCENARIO)
    rows = world.reset(3, (fault,))
    start(policy, SCENARIO, 3)
    places = []
    for _ in range(200):
        rows = world.step(policy.act(rows))
        places.append(world.state.robot_position.copy())
    return np.array(places)


def compare(commands: Commands, commands_in_c: Commands, scenario: Scenario, count: Replay) -> None:
    """Count in which commands (N, 4) C differs, and by how much."""
    difference = np.abs(commands - commands_in_c).max(axis=1)
    elsewhere = difference > ROUNDED
    count.n_decisions += len(commands)
    count.n_unequal += int((difference > 0.0).sum())
    count.n_elsewhere += int(elsewhere.sum())
    count.n_rounded += int(((difference > EXACT) & ~elsewhere).sum())
    off = np.abs(velocities(commands, scenario) - velocities(commands_in_c, scenario))
    count.worst = max(count.worst, 1000.0 * float(off[~elsewhere].max(initial=0.0)))


def velocities(commands: Commands, scenario: Scenario) -> NDArray[np.complex128]:
    """Return velocities (N,) [m/s], in the frames of the bodies as they stand before they turn."""
    turn = commands[:, 2] * scenario.max_turn_rate * scenario.control_period
    ahead = scenario.max_speed * (commands[:, 0] + 1j * commands[:, 1])
    return np.asarray(ahead * np.exp(1j * turn), np.complex128)


def take_over(policy: Any, controller: CFile, robots: NDArray[np.int64]) -> None:
    """Let robots of the C file remember what those of the policy do."""
    state: dict[str, Any] = {}
    if hasattr(policy, "_frame"):
        state = {"turned": policy._frame.turned, "memory": policy._frame.memory}
    if hasattr(policy, "_outputs"):
        state["outputs"] = policy._outputs
    if hasattr(policy, "_heading"):
        state["heading"] = policy._heading
    fields: Any = [("key", "u8"), ("count", "i4")]
    fields += [(name, numbers.dtype, numbers.shape[1:]) for name, numbers in state.items()]
    structs = np.frombuffer(bytearray(controller._robots), np.dtype(fields, align=True))
    for name, numbers in state.items():
        structs[name][robots] = numbers[robots]
    controller._robots = structs.tobytes()


@pytest.mark.unmeasured
@needs_gcc
@pytest.mark.compiled
@pytest.mark.parametrize("name", NAMES)
def test_the_c_file_decides_as_the_policy_does(name: str, tmp_path: Path) -> None:
    counts = replay(name, SCENARIO.replace(duration=40.0), range(2), tmp_path)
    in_float, in_double = counts
    assert in_float.n_decisions == 20_000
    assert in_float.n_elsewhere <= 20
    assert in_float.n_rounded <= (2_000 if name == "homing-stock" else 100)
    assert in_float.worst < 5.0
    assert in_double.n_unequal == 0


@pytest.mark.unmeasured
@needs_gcc
@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("homing-stock", "FM4_jam:2@5"),
        ("ppo-robust", "FM1:2"),
        pytest.param("homing", "FM3:2", marks=pytest.mark.daily),
        pytest.param("swarm-dt", "FM2:2@5", marks=pytest.mark.daily),
    ],
)
def test_a_run_of_the_c_file_in_double_is_the_run_in_python(
    name: str, fault: str, tmp_path: Path
) -> None:
    _, in_double = c_files(name, SCENARIO, tmp_path)
    in_python, in_c = (paths(policies.load(of), fault) for of in (name, f"c:{in_double}"))
    np.testing.assert_array_equal(in_c, in_python)


@needs_gcc
@pytest.mark.compiled
def test_a_network_that_sees_items_says_classes_and_has_a_role_decides_so_in_c(
    tmp_path: Path,
) -> None:
    network = Network(
        hidden=(12,), sees_items=True, head="classes", role=True, exploration=0.5, decides_every=2
    )
    rng = np.random.default_rng(0)
    shapes = tensor_shapes(network)
    tensors = {name: rng.normal(0, 0.5, shape).astype("f4") for name, shape in shapes.items()}
    path = tmp_path / "classes.safetensors"
    write_policy(path, PolicyCard(name="classes", network=network), tensors)
    counts = replay(str(path), SCENARIO.replace(duration=10.0), range(1), tmp_path)
    in_float, in_double = counts
    assert in_float.n_decisions == 2_500
    assert in_float.n_rounded <= 10
    # Every other direction lies halfway between two beams, where `float` may round the frame to
    # the other one: about one decision in sixty.
    assert in_float.n_elsewhere <= 75
    assert in_double.n_rounded + in_double.n_elsewhere <= 1


@needs_gcc
@pytest.mark.daily
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("preset", ["paper", "realistic"])
def test_the_c_file_decides_as_the_policy_does_in_a_quarter_of_a_million_decisions(
    name: str, preset: str, tmp_path: Path
) -> None:
    scenario = Scenario.preset(preset).replace(restock=True, duration=200.0)
    counts = replay(name, scenario, range(5), tmp_path)
    sys.stdout.write(f"{name} {preset} {counts}\n")  # for the table of docs/c.md
    in_float, in_double = counts
    assert in_float.n_decisions == 250_000
    assert in_float.n_elsewhere <= 250
    assert in_float.n_rounded <= (25_000 if name == "homing-stock" else 1_250)
    assert in_float.worst < 5.0
    assert in_double.n_unequal == 0


@pytest.mark.unmeasured
@needs_gcc
@pytest.mark.parametrize("name", NAMES)
def test_it_compiles_without_a_warning_and_takes_little(name: str, tmp_path: Path) -> None:
    files = write_c(policies.load(name), SCENARIO, tmp_path / "robot.c")
    assert sizes_of(files.source, ["gcc", "-DSWARM_DOUBLE"]).flash < 128 * 1024
    optimized = sizes_of(files.source, ["gcc", "-mtune=generic", "-g"])
    assert optimized.compiler == "gcc -mtune=generic"
    sizes = sizes_of(files.source, ["gcc"])
    assert sizes.compiler == "gcc"
    assert sizes.flash < 128 * 1024
    assert sizes.stack is not None
    assert sizes.stack < 4 * 1024
    part = tmp_path / "part.o"
    subprocess.run(["gcc", "-std=c99", "-c", str(files.source), "-o", str(part)], check=True)
    names = subprocess.run(["nm", "-u", str(part)], capture_output=True, text=True, check=True)
    if shutil.which("g++"):
        program = tmp_path / "main.cpp"
        program.write_text(
            '#include "robot.h"\nint main() { swarm_robot robot; swarm_reset(&robot, 1, 0); }\n'
        )
        words = ["g++", str(program), str(part), "-lm", "-o", str(tmp_path / "main")]
        subprocess.run(words, check=True)
    # Of floats, and what compilers use of their own accord: no heap, no files.
    assert re.fullmatch(
        r"(\s*U (\w+f|mem\w+|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_)\n)+", names.stdout
    )


@pytest.mark.parametrize("name", NAMES)
def test_it_compiles_for_a_cortex_m4_and_fits(name: str, tmp_path: Path) -> None:
    compiler = compiler_for_cortex_m4()
    if compiler is None:
        pytest.skip("needs arm-none-eabi-gcc or the package ziglang")
    files = write_c(policies.load(name), SCENARIO, tmp_path / "robot.c")
    sizes = sizes_of(files.source, compiler)
    assert sizes.flash < 128 * 1024
    assert sizes.stack is not None
    assert sizes.stack < 4 * 1024


@pytest.mark.unmeasured
@needs_gcc
@pytest.mark.parametrize(
    ("name", "n_steps"),
    [
        ("homing-stock", 100_000),
        ("swarm-dt", 100_000),
        # A step of the network takes as long as a hundred of a script.
        pytest.param("ppo-robust", 2_000_000, marks=pytest.mark.daily),
        *(pytest.param(name, 10_000_000, marks=pytest.mark.daily) for name in NAMES[:3]),
    ],
)
def test_no_row_makes_it_read_or_compute_what_is_not_there(
    name: str, n_steps: int, tmp_path: Path
) -> None:
    files = write_c(policies.load(name), SCENARIO, tmp_path / "robot.c")
    program = tmp_path / "fuzz"
    checks = "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"
    optimization = "-O2" if n_steps > 100_000 else "-O0"  # to compile takes longer than to run
    sources = "-include", str(files.source), str(FUZZ), "-lm"
    build = ["gcc", "-std=c99", optimization, *checks, *sources, "-o", str(program)]
    done = subprocess.run(build, capture_output=True, text=True)
    if "cannot find" in done.stderr:
        pytest.skip("needs the sanitizers of gcc")
    assert done.returncode == 0, done.stderr
    done = subprocess.run([program, str(n_steps)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@needs_gcc
def test_a_row_with_what_is_no_number_leaves_a_robot_as_it_is(tmp_path: Path) -> None:
    files = write_c(policies.load("homing"), SCENARIO, tmp_path / "robot.c")
    controller: Any = policies.load(f"c:{files.source}")
    controller.reset(2, 0)
    before = controller._robots
    rows = np.ones((2, 141), np.float32)
    rows[0, 100] = np.nan
    assert controller.act(rows)[0].tolist() == [0.0, 0.0, 0.0, 0.0]
    size = controller.robot_size
    assert controller._robots[:size] == before[:size]
    assert controller._robots[size:] != before[size:]


def test_the_files_say_what_they_are_for(tmp_path: Path) -> None:
    files = write_c(policies.load("homing-stock", patience=8.0), SCENARIO, tmp_path / "robot.c")
    header = files.header.read_text()
    assert "HomingStock(patience=8.0)" in header
    assert "#define SWARM_PERIOD 0.1f" in header
    assert f"double memory[{N_COLUMNS}];" in header
    assert header.startswith("/* HomingStock(patience=8.0), for robots of this body and control ")
    columns = header.partition("nearest first:\n")[2].partition(" */\n")[0].splitlines()
    assert columns[0].startswith(" *   0 to 15: range_robots [m], to robots; beam k looks k * 22.5")
    assert columns[1:3] == [
        " *       full range where it meets nothing",
        " *   16 to 31: range_walls [m], to walls and obstacles",
    ]
    assert " *   49 to 84, every 5th: item_x [m], its centre, forward" in columns
    assert " *   132: carrying [flag], it carries an item" in columns
    assert columns[-1].startswith(" *   140: turn_rate [rad/s], to the left")
    assert {"#define SWARM_ROW 141", "#define SWARM_COMMAND 4"} <= {
        line.partition(" /*")[0] for line in header.splitlines()
    }
    assert '#define SWARM_STREAM "homing" /*' in header
    assert (
        f"int32_t count; /* of its steps */\n    double turned;\n    double memory[{N_COLUMNS}"
        in header
    )
    assert ".patience = 8.0f," in files.source.read_text()
    with pytest.raises(PolicyError, match="policy = Central: should be homing, homing-stock"):
        write_c(policies.load("central"), SCENARIO, tmp_path / "robot.c")


@needs_gcc
def test_what_they_take_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = write_c(policies.load("swarm-dt"), SCENARIO, tmp_path / "robot.c")
    text = str(files)
    assert "a robot keeps 24 bytes" in text
    assert re.search(r"cc: [\d,]+ bytes of flash, at most \d+ bytes of stack", text)
    times = r"a step on this machine \(.+\): median ([\d.]+) us, longest ([\d.]+) us of 12,500"
    median, longest = map(float, re.search(times, text).groups())  # type: ignore[union-attr]
    assert 0.0 < median <= longest
    monkeypatch.setattr(c_sizes, "_N_STEPS", 5)
    monkeypatch.setattr(c_sizes, "compiler_for_cortex_m4", lambda: ["gcc", "-DSWARM_DOUBLE"])
    assert re.search(r"cc: .*\ngcc -DSWARM_DOUBLE: [\d,]+ bytes of flash, at most", str(files))
    monkeypatch.setattr(c_sizes, "compiler_for_cortex_m4", lambda: None)
    assert "\nneither arm-none-eabi-gcc nor ziglang here: sizes on a Cortex-M4" in str(files)
    monkeypatch.setenv("CC", "no-such-compiler")
    assert "neither sizes nor times: cannot run the compiler no-such-compiler" in str(files)
