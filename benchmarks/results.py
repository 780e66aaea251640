"""Contestants that are run in turns, and what their runs took, as a table and as JSON."""

from __future__ import annotations

import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table


@dataclass
class Contestant:
    """Something that is run again and again.

    Attributes:
        name: as the table has it.
        includes: what one of its steps includes.
        run: takes its steps once; returns the seconds they took, or None if this times the run.
        agent_steps: how many steps of one agent a run takes.
        control_steps: how many steps of everything a run takes.
        base: the contestant whose cost its own is divided by, or None.
        uses_wall: timed by the clock, not by processor time, as several threads must be.
        seconds: of each run so far.
    """

    name: str
    includes: str
    run: Callable[[], float | None]
    agent_steps: int
    control_steps: int
    base: str | None = None
    uses_wall: bool = False
    seconds: list[float] = field(default_factory=list)

    def take_turn(self) -> None:
        """Run once and note what it took."""
        # Processor time: on a machine that does other things too, the clock counts them.
        clock = time.perf_counter if self.uses_wall else time.process_time
        began = clock()
        took = self.run()
        self.seconds.append(clock() - began if took is None else took)

    @property
    def microseconds(self) -> float:
        """Median cost of a control step [us]."""
        return statistics.median(self.seconds) / self.control_steps * 1e6

    @property
    def rate(self) -> float:
        """Median agent-steps per second."""
        return self.agent_steps / statistics.median(self.seconds)

    def ratio_to(self, base: Contestant) -> float:
        """Return the median, over turns, of its cost per agent-step as a multiple of `base`'s."""
        here = [seconds / self.agent_steps for seconds in self.seconds]
        there = [seconds / base.agent_steps for seconds in base.seconds]
        return statistics.median(mine / other for mine, other in zip(here, there))


def in_turns(contestants: Sequence[Contestant], repeats: int) -> None:
    """Run everybody once per repeat, so that whatever slows the machine slows all of them."""
    for _ in range(repeats):
        for contestant in contestants:
            contestant.take_turn()


def machine() -> dict[str, Any]:
    """Return where and with what the figures came about."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "numba", "pymunk")},
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def show(console: Console, contestants: Sequence[Contestant], title: str) -> None:
    """Print one row per contestant."""
    table = Table(title=title)
    for column in ("", "agent-steps per s", "us per step", "cost", "a step includes"):
        left = column in ("", "a step includes")
        table.add_column(column, justify="left" if left else "right")
    for contestant in contestants:
        table.add_row(
            contestant.name,
            f"{contestant.rate:,.0f}",
            f"{contestant.microseconds:,.0f}",
            _cost(contestant, contestants),
            contestant.includes,
        )
    console.print(table)


def as_json(contestants: Sequence[Contestant], **more: Any) -> dict[str, Any]:
    """Return everything, every repeat included."""
    return {
        "machine": machine(),
        "contestants": [
            {
                "name": contestant.name,
                "includes": contestant.includes,
                "agent_steps_per_second": contestant.rate,
                "microseconds_per_step": contestant.microseconds,
                "base": contestant.base,
                "cost_to_base": _ratio(contestant, contestants),
                "timed_by": "wall" if contestant.uses_wall else "processor",
                "agent_steps": contestant.agent_steps,
                "seconds": contestant.seconds,
            }
            for contestant in contestants
        ],
        **more,
    }


def save(folder: Path, found: Mapping[str, Any]) -> None:
    """Write benchmark.json."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "benchmark.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def _ratio(contestant: Contestant, contestants: Sequence[Contestant]) -> float | None:
    bases = {other.name: other for other in contestants}
    return contestant.ratio_to(bases[contestant.base]) if contestant.base else None


def _cost(contestant: Contestant, contestants: Sequence[Contestant]) -> str:
    ratio = _ratio(contestant, contestants)
    return "" if ratio is None else f"{ratio:.2f} x {contestant.base}"


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
