"""Compiles controllers in C, once for each content; what was compiled is kept in a cache folder."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from swarm_logistics_env.core.errors import PolicyError

_HOST = Path(__file__).parent / "c_host"
# No product is joined with a sum, so that more machines compute the same.
FLAGS = ("-O2", "-ffp-contract=off")
# By the ending of a file: the environment variable that names its compiler, and usual compilers.
COMPILERS: Mapping[str, tuple[str, Sequence[str]]] = {
    ".c": ("CC", ("cc", "gcc", "clang")),
    ".cpp": ("CXX", ("c++", "g++", "clang++")),
}
_TOLD = 6  # lines of a compiler's message


def compiler_of(path: Path) -> list[str]:
    """Return the command of this system's compiler for a file, for its name's ending.

    Raises:
        PolicyError: there is none.
    """
    if path.suffix not in COMPILERS:
        raise PolicyError(f"{path}: should end in {' or '.join(COMPILERS)}")
    variable, names = COMPILERS[path.suffix]
    if command := os.environ.get(variable, "").split():
        return command
    compiler = next(filter(None, map(shutil.which, names)), None)
    if compiler is None:
        raise PolicyError(
            f"{path} has to be compiled, and there is no compiler ({', '.join(names)}): install "
            f"one (Debian and Ubuntu: apt install gcc g++; macOS: xcode-select --install; Windows: "
            f"MinGW-w64), or name it in the environment variable {variable}"
        )
    return [compiler]


def sources_of(path: Path) -> dict[Path, bytes]:
    """Return the contents of a file and of those that it includes by "name", and these.

    Raises:
        PolicyError: the file cannot be read.
    """
    sources: dict[Path, bytes] = {}
    waiting = [path]
    while waiting:
        file = waiting.pop()
        try:
            content = file.read_bytes()
        except OSError as error:
            raise PolicyError(f"cannot read {file}: {error.strerror or error}") from error
        sources[file] = content
        for name in re.findall(rb'^[ \t]*#[ \t]*include[ \t]*"([^"\n]+)"', content, re.MULTILINE):
            included = file.parent / os.fsdecode(name)
            if included.is_file() and included not in sources:
                waiting.append(included)
    return sources


def compiled_controller(path: Path) -> Path:
    """Return the program that a controller's file and the host make.

    Raises:
        PolicyError: the file cannot be read or compiled, or there is no compiler.
    """
    compiler = compiler_of(path)
    digest = hashlib.sha256(platform.machine().encode())
    for part in (*compiler, *FLAGS, path.suffix):
        digest.update(part.encode() + b"\0")
    for file in (*sources_of(path), *sorted(_HOST.glob("*.c"))):
        digest.update(file.read_bytes() + b"\0")
    program = _cache() / f"{digest.hexdigest()[:32]}.exe"
    if not program.is_file():
        with tempfile.TemporaryDirectory(dir=program.parent) as folder:
            new_program = Path(folder, "part.exe")
            _compile(compiler, path, new_program)
            # Whole or not at all, whoever compiles it at the same time.
            new_program.replace(program)
    return program


def _compile(compiler: list[str], path: Path, program: Path) -> None:
    language = "c" if path.suffix == ".c" else "c++"
    parts = [program.with_suffix(".controller.o"), program.with_suffix(".host.o")]
    including = ["-x", language, "-include", str(path.resolve())]
    run_compiler(
        [*compiler, *FLAGS, *including, "-c", str(_HOST / "controller.c"), "-o", str(parts[0])],
        path,
    )
    host = [*compiler_of(Path("host.c")), *FLAGS, "-c", str(_HOST / "host.c"), "-o", str(parts[1])]
    run_compiler(host, path)
    run_compiler([*compiler, *map(str, parts), "-lm", "-o", str(program)], path)


def run_compiler(command: Sequence[str], path: Path) -> str:
    """Run a compiler, linker or another tool, and return what it prints.

    Raises:
        PolicyError: it fails; with the beginning of what it says of the file at `path`.
    """
    try:
        environment = os.environ | {"LC_ALL": "C"}
        # A text, as `errors` says.
        done = subprocess.run(command, capture_output=True, errors="replace", env=environment)
    except OSError as error:
        raise PolicyError(
            f"cannot run the compiler {command[0]}: {error.strerror or error}"
        ) from error
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        message = "\n".join(lines[:_TOLD]) or f"exit status {done.returncode}"
        raise PolicyError(f"{path} cannot be compiled:\n{message}")
    return done.stdout


@functools.cache
def _cache() -> Path:
    """Return the folder where programs are kept; one of this process where none can be written."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "swarm-logistics-env" / "c"
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):  # RuntimeError: nobody has a home
        _temporary.append(tempfile.TemporaryDirectory(prefix="swarm-logistics-"))
        return Path(_temporary[-1].name)


_temporary: list[tempfile.TemporaryDirectory[str]] = []  # removed as the process ends
