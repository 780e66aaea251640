"""Attributions over many seeds: worker processes, a file of finished seeds, tables, a picture."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.fault_analysis.attribution import (
    Attribution,
    Losses,
    Share,
    check_fault,
    losses,
)
from swarm_logistics_env.policies.code_identity import code_digest
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies.engines import workers
from swarm_logistics_env.tasks.code_version import code_version
from swarm_logistics_env.tasks.policy_choice import policy_identity, policy_of
from swarm_logistics_env.warehouse import Fault

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FINISHED, TABLE, PICTURE = "losses.jsonl", "attribution.csv", "attribution.png"
HEADINGS = ("part", "meaning", "robots", "lost", "low", "high")


def attribute_in(
    out: Path,
    scenario: Scenario,
    policy: object,
    fault: Fault,
    seeds: Sequence[int],
    processes: int = 1,
    on_seed: Callable[[], object] = lambda: None,
) -> Attribution:
    """Return what `attribute` does, from the seeds that are in `out` and those that are missing.

    Args:
        out: directory; each seed is kept there when it is finished.
        policy: as `policies.load` knows it, or a policy.
        processes: worker processes; 1 means this process.
        on_seed: called after each seed that was played.

    Raises:
        FaultError: as `attribute`.
        StudyError: the directory holds another attribution, or cannot be written.
    """
    check_fault(fault)
    about = {
        "scenario": json.loads(scenario.to_json()),
        "policy": policy_identity(policy),
        "fault": json.loads(fault.to_json()),
        "code": f"{code_version()}, {code_digest(Losses)}",
    }
    finished = _finished(out / FINISHED, about)
    missing = [seed for seed in seeds if seed not in finished]
    arguments = [(scenario, policy, fault, seed) for seed in missing]
    with (
        (out / FINISHED).open("a", encoding="utf-8") as file,
        closing(_played(arguments, processes)) as played,
    ):
        if not finished and file.tell() == 0:
            file.write(json.dumps(about) + "\n")
        for found in played:
            finished[found.seed] = found
            file.write(json.dumps(found._asdict()) + "\n")
            file.flush()
            os.fsync(file.fileno())
            on_seed()
    return Attribution(fault, tuple(finished[seed] for seed in seeds))


def write_tables(found: Attribution, out: Path) -> list[Path]:
    """Write attribution.csv, and with matplotlib attribution.png; return their paths."""
    with (out / TABLE).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(HEADINGS)
        writer.writerows(
            (row.name, row.meaning, row.robots, *row.lost)
            for row in (found.total, *found.parts, *found.roles, *found.capabilities)
        )
    try:
        _draw(found, out / PICTURE)
    except ImportError:
        return [out / TABLE]
    return [out / TABLE, out / PICTURE]


def _losses(arguments: tuple[Scenario, object, Fault, int]) -> Losses:
    scenario, policy, fault, seed = arguments
    return losses(scenario, policy_of(policy), fault, seed)


def _played(
    arguments: Sequence[tuple[Scenario, object, Fault, int]], processes: int
) -> Generator[Losses, None, None]:
    if processes == 1 or len(arguments) < 2:
        yield from map(_losses, arguments)
        return
    with workers(min(processes, len(arguments))) as pool:
        for future in as_completed([pool.submit(_losses, each) for each in arguments]):
            yield future.result()


def _finished(path: Path, about: Mapping[str, Any]) -> dict[int, Losses]:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    except OSError as error:
        raise StudyError(f"cannot use {path.parent}: {error.strerror}") from error
    if lines and not lines[-1].endswith("\n"):  # it was being written when the program was killed
        path.write_text("".join(lines[:-1]), encoding="utf-8")
        del lines[-1]
    if not lines:
        return {}
    there = json.loads(lines[0])
    if different := [name for name in about if there.get(name) != about[name]]:
        raise StudyError(
            f"{path.parent} holds an attribution with another {' and '.join(different)}: should be "
            "another directory"
        )
    found = [Losses(**json.loads(line)) for line in lines[1:]]
    return {
        each.seed: each._replace(
            robots={int(robot): (role, lost) for robot, (role, lost) in each.robots.items()}
        )
        for each in found
    }


def _draw(found: Attribution, path: Path) -> None:
    from matplotlib.figure import Figure

    roles = [row for row in found.roles if row.robots]
    groups = (("by role at the onset", roles), ("by lost capability", list(found.capabilities)))
    figure = Figure(figsize=(8.0, 1.6 + 0.38 * (len(roles) + len(found.capabilities) + 3)))
    heights = [3.0, *(max(len(rows), 1) for _, rows in groups)]
    panels = figure.subplots(3, 1, sharex=True, height_ratios=heights)
    _bars(panels[0], [found.total, *found.parts], "in all")
    for panel, (title, rows) in zip(panels[1:], groups):
        _bars(panel, rows, title)
    panels[-1].set_xlabel(
        f"deliveries lost after the onset, per episode (mean and 95 % interval, "
        f"{len(found.seeds)} seeds)"
    )
    fault = found.fault
    figure.suptitle(f"What {fault.mode} costs from {fault.onset:g} s on")
    figure.tight_layout()
    figure.savefig(path, dpi=150)


def _bars(panel: Axes, rows: Sequence[Share], title: str) -> None:
    for place, row in enumerate(rows):
        value, low, high = row.lost
        panel.barh(place, value, color="#4477aa", height=0.6)
        if low is not None and high is not None:
            panel.plot([low, high], [place, place], color="#222222", linewidth=1.5)
    labels = [row.name.replace("_", " ") for row in rows]
    panel.set_yticks(range(len(rows)), labels)
    panel.invert_yaxis()
    panel.axvline(0.0, color="#888888", linewidth=0.8)
    panel.set_title(title, loc="left", fontsize="medium")
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
