"""What the linter or the type checker is told to overlook has its reason beside it."""

from __future__ import annotations

import re

from verification.mutants.mutation import ROOT

IGNORED = re.compile(r"# (type: ignore\[[a-z, -]+\]|noqa: [A-Z0-9, ]+)(?P<reason> *(#|-) \w.*)?$")
FOLDERS = ("swarm_logistics_env", "verification", "benchmarks", "interop", "examples")


def test_every_ignore_in_the_package_has_a_reason() -> None:
    bare = []
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            before = ""
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                found = IGNORED.search(line)
                said = before.strip().startswith("#") or (found and found["reason"])
                if ("# type: ignore" in line or "# noqa" in line) and not said:
                    bare.append(f"{path.relative_to(ROOT)}:{number}")
                before = line
    assert bare == []
