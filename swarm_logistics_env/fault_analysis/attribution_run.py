"""Attributions over many seeds: worker processes, a file of finished seeds, and a table."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import as_completed
from contextlib import closing
from pathlib import Path
from statistics import fmean
from typing import Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.fault_analysis.attribution import (
    Attribution,
    Losses,
    check_fault,
    losses,
)
from swarm_logistics_env.policies.code_identity import code_digest
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies.engines import workers
from swarm_logistics_env.studies.store import write_csv
from swarm_logistics_env.tasks.code_version import code_version
from swarm_logistics_env.tasks.policy_choice import policy_identity, policy_of
from swarm_logistics_env.warehouse import Fault

FINISHED, TABLE = "losses.jsonl", "attribution.csv"


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


def write_table(found: Attribution, policy: str, fault: str, out: Path) -> Path:
    """Write attribution.csv, which a study's report reads; return its path.

    Args:
        policy, fault: in words.
    """
    seeds = found.seeds
    about: dict[str, Any] = {
        "policy": policy,
        "fault": fault,
        "seeds": len(seeds),
        "capped": sum(each.is_capped for each in seeds),
        "blocked_seconds": fmean(each.blocked_seconds for each in seeds),
        "anchoring_seconds": fmean(each.anchoring_seconds for each in seeds),
    }
    write_csv(out / TABLE, found.table().assign(**about))
    return out / TABLE


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
    if len(lines) < 2:  # no seed is finished, whatever was asked then
        path.unlink(missing_ok=True)
        return {}
    try:
        there, *rows = map(json.loads, lines)
        different = [name for name in about if dict(there).get(name) != about[name]]
        found = [] if different else [Losses(**row) for row in rows]
    except (TypeError, ValueError) as error:
        raise StudyError(
            f"{path} is damaged ({error}): should be deleted, and its seeds played again"
        ) from None
    if different:
        raise StudyError(
            f"{path.parent} holds an attribution with another {' and '.join(different)}: should be "
            "another directory, as --out names it"
        )
    return {
        each.seed: each._replace(
            robots={int(robot): (role, lost) for robot, (role, lost) in each.robots.items()}
        )
        for each in found
    }
