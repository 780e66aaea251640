"""Contestants that are run in turns, and what their runs took, as a table and as JSON."""

from __future__ import annotations

import json
import os
import platform
import re
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

_SHOWN = ("agent_steps_per_second", "microseconds_per_step", "cost_to_base", "base", "includes")


@dataclass
class Contestant:
    """Something that is run again and again.

    Attributes:
        name: as the table has it.
        includes: what one of its steps includes.
        run: takes its steps once; returns the seconds they took.
        agent_steps: how many steps of one agent a run takes.
        control_steps: how many steps of everything a run takes.
        base: the contestant whose cost its own is divided by, or None.
        timed_by: "processor", as on a machine that does other things too the clock counts them;
            "wall" where several threads work.
        seconds: of each run so far.
    """

    name: str
    includes: str
    run: Callable[[], float]
    agent_steps: int
    control_steps: int
    base: str | None = None
    timed_by: str = "processor"
    seconds: list[float] = field(default_factory=list)

    def ratio_to(self, base: Contestant) -> float:
        """Return the median, over turns, of its cost per agent-step as a multiple of `base`'s."""
        here = [seconds / self.agent_steps for seconds in self.seconds]
        there = [seconds / base.agent_steps for seconds in base.seconds]
        return statistics.median(mine / other for mine, other in zip(here, there))


def in_turns(contestants: Sequence[Contestant], repeats: int) -> None:
    """Run everybody once per repeat, so that whatever slows the machine slows all of them."""
    for _ in range(repeats):
        for contestant in contestants:
            contestant.seconds.append(contestant.run())


def rows(contestants: Sequence[Contestant]) -> list[dict[str, Any]]:
    """Return a row of each contestant, every repeat included."""
    known = {one.name: one for one in contestants}
    return [
        {
            "name": one.name,
            "includes": one.includes,
            "agent_steps_per_second": one.agent_steps / statistics.median(one.seconds),
            "microseconds_per_step": statistics.median(one.seconds) / one.control_steps * 1e6,
            "base": one.base,
            "cost_to_base": one.ratio_to(known[one.base]) if one.base else None,
            "timed_by": one.timed_by,
            "agent_steps": one.agent_steps,
            "seconds": one.seconds,
        }
        for one in contestants
    ]


def shown(found: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows as a table; cost: per agent-step, less is better."""
    table = pd.DataFrame(found).set_index("name")[list(_SHOWN)]
    return table.to_string(float_format="{:,.2f}".format, na_rep="")


def save(folder: Path, found: Sequence[Mapping[str, Any]], seconds: Mapping[str, float]) -> None:
    """Write benchmark.json: the rows, and where and with what they came about."""
    machine = {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "numba", "pymunk")},
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    record = {"machine": machine, "contestants": found, "seconds": seconds}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "benchmark.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text(encoding="utf-8") if cpuinfo.exists() else ""
    found = re.search(r"^model name\s*: (.*)", text, re.MULTILINE)
    return found[1] if found else platform.processor() or platform.machine()
