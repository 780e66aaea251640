"""Contestants that are run in turns, and what their runs took, as a table and as JSON."""

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
    """Something that is run again and again; `run` takes its steps once and returns the seconds."""

    name: str
    includes: str  # what one of its steps includes
    run: Callable[[], float]
    agent_steps: int  # of single agents, in a run
    control_steps: int  # of everything, in a run
    base: str | None = None  # the contestant whose cost its own is divided by
    seconds: list[float] = field(default_factory=list)  # of each run so far

    def ratio_to(self, base: "Contestant") -> float:
        """Return the median, over turns, of its cost per agent-step as a multiple of `base`'s."""
        costs = [seconds / self.agent_steps for seconds in self.seconds]
        base_costs = [seconds / base.agent_steps for seconds in base.seconds]
        return statistics.median(cost / base_cost for cost, base_cost in zip(costs, base_costs))


def in_turns(contestants: Sequence[Contestant], repeats: int) -> None:
    """Run everybody once per repeat, so that whatever slows the machine slows all of them."""
    for _ in range(repeats):
        for contestant in contestants:
            contestant.seconds.append(contestant.run())


def rows(contestants: Sequence[Contestant]) -> list[dict[str, Any]]:
    """Return a row of each contestant, every repeat included."""
    by_name = {entry.name: entry for entry in contestants}
    return [
        {
            "name": entry.name,
            "includes": entry.includes,
            "agent_steps_per_second": entry.agent_steps / statistics.median(entry.seconds),
            "microseconds_per_step": statistics.median(entry.seconds) / entry.control_steps * 1e6,
            "base": entry.base,
            "cost_to_base": entry.ratio_to(by_name[entry.base]) if entry.base else None,
            "agent_steps": entry.agent_steps,
            "seconds": entry.seconds,
        }
        for entry in contestants
    ]


def shown(entries: Sequence[Mapping[str, Any]]) -> str:
    """Return the rows as a table; cost: per agent-step, less is better."""
    table = pd.DataFrame(entries).set_index("name")[list(_SHOWN)]
    return table.to_string(float_format="{:,.2f}".format, na_rep="")


def save(folder: Path, entries: Sequence[Mapping[str, Any]], seconds: Mapping[str, float]) -> None:
    """Write benchmark.json: the rows, and where and with what they came about."""
    cpuinfo = Path("/proc/cpuinfo")
    text = cpuinfo.read_text(encoding="utf-8") if cpuinfo.exists() else ""
    processor = re.search(r"^model name\s*: (.*)", text, re.MULTILINE)
    machine = {
        "processor": processor[1] if processor else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "numba", "pymunk")},
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    record = {"machine": machine, "contestants": entries, "seconds": seconds}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "benchmark.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
