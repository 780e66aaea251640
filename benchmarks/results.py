"""What was measured, as a table and as JSON."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.timing import Contestant


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


def show(
    console: Console,
    contestants: Sequence[Contestant],
    missing: Mapping[str, str],
    title: str,
) -> None:
    """Print one row per contestant, and one per peer that does not run."""
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
    for name, reason in missing.items():
        table.add_row(name, "-", "-", "-", f"does not run: {reason}")
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
