"""Results in JSON: of POGEMA, and in the format of marl-eval, which BenchMARL writes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.spi.trials.table import Table

# What POGEMA measures, the first that is there is taken for performance.
_POGEMA_METRICS = ("avg_throughput", "ISR", "CSR")
_RETURNS = ("return", "mean_episode_return", "episode_return", "reward")


def read(path: Path, content: bytes, digest: str) -> Table | None:
    """Return the table of results in JSON; None: the file is no JSON.

    Raises:
        IndicatorError: it is JSON of neither kind.
    """
    if path.suffix.lower() != ".json":
        return None
    try:
        results = json.loads(content)
    except ValueError as error:
        raise IndicatorError(f"{path} is no JSON: {error}") from error
    if _is_pogema(results):
        return _pogema(path, digest, results)
    records = [*_marl_eval(results)]
    if records:
        return _marl_eval_table(path, digest, records)
    raise IndicatorError(
        f"{path}: should be results as POGEMA writes them (a list of metrics, env_grid_search and "
        "algorithm) or as marl-eval does (environment > task > algorithm > run); else save the "
        "trials as CSV"
    )


def _is_pogema(results: Any) -> bool:
    return (
        isinstance(results, list)
        and bool(results)
        and all(
            isinstance(entry, dict) and {"metrics", "env_grid_search", "algorithm"} <= entry.keys()
            for entry in results
        )
    )


def _pogema(path: Path, digest: str, results: list[dict[str, Any]]) -> Table:
    records = [
        {"algorithm": entry["algorithm"], **entry["env_grid_search"], **_numbers(entry["metrics"])}
        for entry in results
    ]
    metrics = [*dict.fromkeys(name for entry in results for name in _numbers(entry["metrics"]))]
    return _table(path, digest, records, metrics, _POGEMA_METRICS, "results of POGEMA")


def _numbers(metrics: dict[str, Any]) -> dict[str, Any]:
    """Return the metrics that are one number, not a list over steps."""
    return {name: value for name, value in metrics.items() if not isinstance(value, list | dict)}


def _marl_eval(results: Any) -> Iterator[dict[str, Any]]:
    """Yield a record for each run: the means of what its last evaluation measured."""
    for environment, tasks in _entries(results):
        for task, algorithms in _entries(tasks):
            for algorithm, runs in _entries(algorithms):
                for run, steps in _entries(runs):
                    metrics = _last_metrics(steps)
                    if metrics:
                        labels = {"environment": environment, "task": task}
                        yield {**labels, "algorithm": algorithm, "run": run, **metrics}


def _entries(value: Any) -> list[tuple[str, Any]]:
    return list(value.items()) if isinstance(value, dict) else []


def _last_metrics(steps: Any) -> dict[str, float]:
    """Return the means of a run's absolute metrics, or of its last step where it has none."""
    entries = dict(_entries(steps))
    measured = entries.get("absolute_metrics")
    if not measured:
        logged = [
            step for step in entries.values() if isinstance(step, dict) and "step_count" in step
        ]
        measured = max(logged, key=lambda step: step["step_count"], default={})
    return {
        name: sum(values) / len(values)
        for name, values in _entries(measured)
        if isinstance(values, list) and values
    }


def _marl_eval_table(path: Path, digest: str, records: list[dict[str, Any]]) -> Table:
    metrics = [*dict.fromkeys(name for record in records for name in record)][4:]
    return _table(path, digest, records, metrics, _RETURNS, "results in the format of marl-eval")


def _table(
    path: Path,
    digest: str,
    records: list[dict[str, Any]],
    metrics: list[str],
    preferred: tuple[str, ...],
    kind: str,
) -> Table:
    """Return the table of records, of whose metrics one is performance."""
    header = [*dict.fromkeys(name for record in records for name in record)]
    performance = next((name for name in preferred if name in metrics), metrics[0])
    cells = [[_text(record.get(name)) for name in header] for record in records]
    other_metrics = [name for name in metrics if name != performance]
    note = f"These are {kind}: P is {performance}"
    note += "; --column performance=NAME takes another metric." if other_metrics else "."
    return Table(
        str(path), digest, header, cells, range(1, len(cells) + 1), "record", kind,
        {"performance": performance}, frozenset(other_metrics), ".", (note,),
    )  # fmt: skip


def _text(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)
