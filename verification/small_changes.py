"""Small changes at random, made by cosmic-ray in a scratch copy, and those that no test catches.

    python -m pip install cosmic-ray
    python -m verification.small_changes logistics --sample 90 --seed 0

Every change stands alone; how many there are, how many are caught, and each survivor are printed.
"""

from __future__ import annotations

import argparse
import difflib
import os
import random
import resource
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from verification.mutants.mutation import scratch_copy

CPU_SECONDS = 120  # a change that never ends is caught


@dataclass(frozen=True)
class Target:
    """What is changed, and what should notice.

    Attributes:
        sources: pattern of the files, in the package.
        tests: what pytest is given.
        is_interpreted: whether kernels are run by the interpreter: compiling takes longer.
    """

    sources: str
    tests: tuple[str, ...]
    is_interpreted: bool = False


TARGETS = {
    "logistics": Target(
        "warehouse/logistics.py",
        ("tests/warehouse/test_logistics.py", "tests/warehouse/test_physics.py",
         "-k", "not (in_a_crowd or 150_robots)"),
        is_interpreted=True,
    ),
    "spi": Target("spi/*.py", ("tests/spi",)),
}  # fmt: skip


def changes(copy: Path, target: Target) -> list[tuple[Path, str, int]]:
    """Return (file, operator, occurrence) of every change that there is, in one order."""
    from cosmic_ray import plugins
    from cosmic_ray.ast import ast_nodes, get_ast_from_path

    found = []
    for path in sorted((copy / "swarm_logistics_env").glob(target.sources)):
        nodes = list(ast_nodes(get_ast_from_path(path)))
        for name in sorted(plugins.operator_names()):
            kind = plugins.get_operator(name)
            if kind.arguments():
                continue
            places = sum(1 for node in nodes for _ in kind().mutation_positions(node))
            found += [(path, name, occurrence) for occurrence in range(places)]
    return found


def is_caught(copy: Path, target: Target) -> bool:
    """Return whether a test fails on the copy as it stands."""
    plugin = ["-p", "verification.interpreted"] if target.is_interpreted else []
    paths = [str(copy), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    if target.is_interpreted:
        environment["NUMBA_DISABLE_JIT"] = "1"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:xdist", "-p", "no:cacheprovider",
         *plugin, *target.tests],
        cwd=copy, env=environment, capture_output=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS)),
    )  # fmt: skip
    return done.returncode != 0


def survivors(copy: Path, target: Target, drawn: list[tuple[Path, str, int]]) -> Iterator[str]:
    """Yield the difference that each change makes which no test catches.

    Raises:
        RuntimeError: the tests fail without any change.
    """
    from cosmic_ray import plugins
    from cosmic_ray.mutating import mutate_code

    if is_caught(copy, target):
        raise RuntimeError(f"{target.tests} fail as the code stands")
    for path, name, occurrence in drawn:
        source = path.read_text(encoding="utf-8")
        changed = mutate_code(source, plugins.get_operator(name)(), occurrence)
        path.write_text(changed, encoding="utf-8")
        try:
            if not is_caught(copy, target):
                lines = difflib.unified_diff(
                    source.splitlines(), changed.splitlines(), path.name, name, n=0, lineterm=""
                )
                yield "\n".join(lines)
        finally:
            path.write_text(source, encoding="utf-8")


def main() -> int:
    """Draw a sample, print what survives; ends with 0 however many do."""
    parser = argparse.ArgumentParser(description="Small changes that no test catches.")
    parser.add_argument("target", choices=sorted(TARGETS))
    parser.add_argument("--sample", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    target = TARGETS[asked.target]
    with scratch_copy() as copy:
        possible = changes(copy, target)
        drawn = random.Random(asked.seed).sample(possible, min(asked.sample, len(possible)))
        n_survivors = 0
        for difference in survivors(copy, target, drawn):
            n_survivors += 1
            print(f"SURVIVES\n{difference}", flush=True)
    caught = len(drawn) - n_survivors
    print(f"{asked.target}: {caught} of {len(drawn)} caught, of {len(possible)} that there are")
    return 0


if __name__ == "__main__":
    sys.exit(main())
