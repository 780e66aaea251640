"""What a controller in C takes of a processor: flash, memory, stack and time."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.c_compiler import compiler_of, run_compiler
from swarm_logistics_env.policies.c_files import PREFIX, CFile
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import Scenario

WARNINGS = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror")
ARM = "arm-none-eabi-gcc"
CORTEX_M4 = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
_N_ROBOTS = 500
_N_STEPS = 20


@dataclass(frozen=True)
class Sizes:
    """What a compiler makes of a file of C.

    Attributes:
        compiler: its command, with the processor.
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


def sizes_of(path: Path, compiler: Sequence[str]) -> Sizes:
    """Return the sizes of a file that a compiler of GNU's kind compiles without a warning.

    Args:
        compiler: its command, with flags for a processor.

    Raises:
        PolicyError: it warns, fails, or is not there.
    """
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder, "part.o")
        flags = (*WARNINGS, "-O2", "-fstack-usage", "-c", str(path.resolve()), "-o", str(part))
        run_compiler([*compiler, *flags], path)
        size = compiler[0].removesuffix("gcc") + "size" if compiler[0].endswith("gcc") else "size"
        table = subprocess.run([size, str(part)], capture_output=True, text=True, check=True).stdout
        text, data, _ = map(int, table.splitlines()[1].split()[:3])
        usage = part.with_suffix(".su")
        frames = re.findall(r"\t(\d+)\t", usage.read_text()) if usage.is_file() else None
    stack = None if frames is None else sum(map(int, frames))
    return Sizes(" ".join([Path(compiler[0]).name, *compiler[1:2]]), text + data, stack)


def microseconds_a_step(path: Path, scenario: Scenario) -> tuple[float, int]:
    """Return the mean time of a robot's step on this machine [us], and the bytes that it keeps.

    Rows are any that the scenario's sensors can give.

    Raises:
        PolicyError: the file cannot be compiled, or there is no compiler.
    """
    controller = CFile(f"{PREFIX}{path}")
    controller.configure(scenario)
    controller.reset(_N_ROBOTS, 0)
    low, high = row.bounds(scenario)
    rng = np.random.default_rng(0)
    times = []
    for _ in range(_N_STEPS):
        rows = rng.uniform(low, high, (_N_ROBOTS, len(low))).astype(np.float32)
        times.append(controller.seconds_of_step(rows))
        controller.act(rows)
    return 1e6 * float(np.mean(times)) / _N_ROBOTS, controller.robot_size


def description_of(path: Path, scenario: Scenario) -> str:
    """Return in lines what a file takes on this machine and on a Cortex-M4.

    What cannot be compiled here is told, too.
    """
    try:
        sizes = [str(sizes_of(path, compiler_of(path)))]
        duration, robot_size = microseconds_a_step(path, scenario)
    except PolicyError as error:
        return f"neither sizes nor times: {error}"
    if shutil.which(ARM):
        sizes.append(str(sizes_of(path, [ARM, *CORTEX_M4])))
    else:
        sizes.append(f"no {ARM} here, so the sizes on a Cortex-M4 are not known")
    return "\n".join(
        [
            f"a robot keeps {robot_size} bytes",
            *sizes,
            f"{duration:.1f} us a step on this machine, the mean of {_N_ROBOTS * _N_STEPS:,}",
        ]
    )
