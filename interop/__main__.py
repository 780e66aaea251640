"""Runs every script in the environment of its library, and prints one table of what came out.

Each environment is made by `make`, so this needs nothing but Python. An environment that cannot be
made and a script that ends with an error are rows of the table, and the exit code is 1.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from interop.results import FAILS_ON_MPE2_TOO, PASSES, RUNS_WITH

ROOT = Path(__file__).parents[1]
README = ROOT / "interop" / "README.md"
BEGIN, END = "<!-- begin: make interop -->\n", "<!-- end: make interop -->\n"

SCRIPTS = (
    ("torchrl", "torchrl_specs"),
    ("torchrl", "torchrl_collector"),
    ("torchrl", "plain_ppo"),
    ("torchrl", "discrete_loop"),
    ("benchmarl", "benchmarl_mappo"),
    ("benchmarl", "benchmarl_learning"),
    ("supersuit", "supersuit_wrappers"),
    ("rllib", "rllib_ppo"),
)

Row = tuple[str, str, str]  # client with its version, what ran, result


def main() -> int:
    """Run all scripts, or those that are named; return the exit code."""
    named = sys.argv[1:]
    chosen = [pair for pair in SCRIPTS if not named or pair[1] in named]
    rows = [row for environment, script in chosen for row in run(environment, script)]
    table = as_markdown(rows)
    print(f"\n{table}")
    if not named:
        before, _, rest = README.read_text(encoding="utf-8").partition(BEGIN)
        _, _, after = rest.partition(END)
        README.write_text(f"{before}{BEGIN}\n{table}\n{END}{after}", encoding="utf-8")
    n_failed = sum(result.startswith("FAILS") for _, _, result in rows)
    print(f"{len(rows)} rows, {n_failed} fail on this side")
    return int(n_failed > 0)


def run(environment: str, script: str) -> list[Row]:
    """Return what a script reports, and a row for its failure, if it fails."""
    folder = f".venvs/{environment}"
    make = subprocess.run(["make", f"{folder}/installed"], cwd=ROOT, check=False)
    if make.returncode != 0:
        return [(environment, script, "FAILS: its environment cannot be made")]
    client, rows = environment, []
    command = [f"{folder}/bin/python", "-m", f"interop.{script}"]
    print(f"\n{' '.join(command)}", flush=True)
    with subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, "PYTHONUNBUFFERED": "1"}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        last = ""
        for line in process.stdout:
            print(line, end="", flush=True)
            last = line.strip() or last
            if line.startswith(RUNS_WITH):
                client = line.removeprefix(RUNS_WITH).strip()
            elif line.startswith(PASSES):
                rows.append((client, line.removeprefix(PASSES).strip(), "passes"))
            elif line.startswith(FAILS_ON_MPE2_TOO):
                what, _, proof = line.removeprefix(FAILS_ON_MPE2_TOO).strip().partition(": ")
                rows.append((client, what, f"{FAILS_ON_MPE2_TOO}{proof}"))
    if process.returncode != 0 or not rows:
        rows.append((client, script, f"FAILS: {last}"))
    return rows


def as_markdown(rows: list[Row]) -> str:
    """Return the rows as a table; a client is named in the first of its rows."""
    lines = ["| Client | On | What ran | Result |", "| --- | --- | --- | --- |"]
    before = ""
    for client, what, result in rows:
        name, _, others = client.partition(", ")
        shown = f"{name} | {others}" if client != before else " | "
        lines.append(f"| {shown} | {what.replace('|', '/')} | {result.replace('|', '/')} |")
        before = client
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    sys.exit(main())
