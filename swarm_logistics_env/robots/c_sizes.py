"""What a controller in C takes of a processor: flash, memory, stack and time."""

from __future__ import annotations

import importlib.util
import platform
import re
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.c_compiler import compiler_of, run_compiler
from swarm_logistics_env.policies.c_files import PREFIX, CFile
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse

WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror")
ARM = "arm-none-eabi-gcc"
CORTEX_M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
# The same processor; of a system that has headers of a C library.
ZIG_CORTEX_M4 = ("-target", "thumb-linux-musleabihf", "-mcpu=cortex_m4+vfp4d16sp")
_N_STEPS = 500


@dataclass(frozen=True)
class Sizes:
    """What a compiler makes of a file of C.

    Attributes:
        compiler: its name, with the processor.
        flash: code and constants, without the C library [bytes].
        stack: the frames of all functions together, which a step cannot exceed [bytes]; None: the
            compiler does not say.
    """

    compiler: str
    flash: int
    stack: int | None

    def __str__(self) -> str:
        stack = "" if self.stack is None else f", at most {self.stack:,} bytes of stack"
        return f"{self.compiler}: {self.flash:,} bytes of flash{stack}"


def compiler_for_cortex_m4() -> list[str] | None:
    """Return the command of a compiler for a Cortex-M4 that computes with floats; None: none here.

    The package ziglang, which holds clang, stands in for GNU's compiler.
    """
    if shutil.which(ARM):
        return [ARM, *CORTEX_M4]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", *ZIG_CORTEX_M4]
    return None


def sizes_of(path: Path, compiler: Sequence[str]) -> Sizes:
    """Return the sizes of a file that a compiler of GNU's kind compiles without a warning.

    Args:
        compiler: its command, with flags for a processor.

    Raises:
        PolicyError: it warns, fails, or is not there.
    """
    name = " ".join([Path(compiler[0]).name, *compiler[1:2]])
    size = compiler[0].removesuffix("gcc") + "size" if compiler[0].endswith("gcc") else "size"
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder, "part.o")
        usage = part.with_suffix(".su")
        flags = [*WARNINGS, "-O2", "-c", str(path.resolve()), "-o", str(part), "-fstack-usage"]
        if "ziglang" in compiler:
            name = "ziglang -mcpu=cortex_m4"
            flags[-1:] = ["-Xclang", "-stack-usage-file", "-Xclang", str(usage)]
        run_compiler([*compiler, *flags], path)
        table = run_compiler([size, str(part)], path)
        text, data, _ = map(int, table.splitlines()[1].split()[:3])
        frames = re.findall(r"\t(\d+)\t", usage.read_text()) if usage.is_file() else None
    stack = None if frames is None else sum(map(int, frames))
    return Sizes(name, text + data, stack)


def microseconds_of_steps(path: Path, scenario: Scenario) -> tuple[NDArray[np.float64], int]:
    """Return how long robots' steps take on this machine [us], and the bytes that a robot keeps.

    Rows are those of a run of 500 steps, which the controller plays.

    Raises:
        PolicyError: the file cannot be compiled, or there is no compiler.
    """
    controller = CFile(f"{PREFIX}{path}")
    controller.configure(scenario)
    controller.reset(scenario.n_robots, 0)
    world = Warehouse(scenario.replace(duration=_N_STEPS * scenario.control_period))
    rows = world.reset(0)
    seconds = []
    while not world.is_over_time:
        seconds.append(controller.seconds_of_step(rows))
        rows = world.step(controller.act(rows))
    return 1e6 * np.concatenate(seconds), controller.robot_size


def description_of(path: Path, scenario: Scenario) -> str:
    """Return in lines what a file takes on this machine and on a Cortex-M4.

    What cannot be compiled here is told, too.
    """
    try:
        sizes = [str(sizes_of(path, compiler_of(path)))]
        times, robot_size = microseconds_of_steps(path, scenario)
        for_cortex_m4 = compiler_for_cortex_m4()
        if for_cortex_m4:
            sizes.append(str(sizes_of(path, for_cortex_m4)))
        else:
            sizes.append(f"neither {ARM} nor ziglang here: sizes on a Cortex-M4 are not known")
    except PolicyError as error:
        return f"neither sizes nor times: {error}"
    durations = f"median {np.median(times):.1f} us, longest {np.max(times):.1f} us"
    step = f"a step on this machine ({_processor()}): {durations} of {len(times):,} in a run"
    return "\n".join([f"a robot keeps {robot_size} bytes", *sizes, step])


def _processor() -> str:
    """Return the name of this machine's processor."""
    facts = Path("/proc/cpuinfo")
    text = facts.read_text(encoding="utf-8") if facts.is_file() else ""
    model = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return model[1] if model else platform.processor() or platform.machine()
