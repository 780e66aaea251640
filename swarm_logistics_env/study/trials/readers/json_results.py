"""Results in JSON: of POGEMA, and in the format of marl-eval, which BenchMARL writes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.table import NoTrialsError, Table

from .data_frame import cell_text

# What POGEMA measures, the first that is there is taken for performance.
_POGEMA_METRICS = ("avg_throughput", "ISR", "CSR")
_LEVELS = ("environment", "task", "algorithm", "run")  # of marl-eval
_COUNTS = ("step_count", "elapsed_time")  # of an evaluation, which are no metrics
_LARGEST = 1e300  # of a number, so that sums are finite
_LONGEST = 40  # signs of a value that a message shows
_RETURNS = ("return", "mean_episode_return", "episode_return", "reward")


def read(path: Path, content: bytes, digest: str) -> Table | None:
    """Return the table of results in JSON; None: the file is no JSON.

    Raises:
        NoTrialsError: it is JSON of neither kind.
        IndicatorError: it cannot be read, or a run lacks what the others have.
    """
    if path.suffix.lower() != ".json":
        return None
    try:
        results = json.loads(content)
    except ValueError as error:
        raise IndicatorError(
            f"{path} is no JSON: {error}; should be saved again, or as CSV"
        ) from error
    except RecursionError as error:
        raise IndicatorError(
            f"{path} is nested too deep: should be results of POGEMA or marl-eval"
        ) from error
    if _is_pogema(results):
        return _pogema(path, digest, results)
    runs = [*_runs(results)]
    if any(isinstance(steps, dict) and _last_metrics(path, run, steps) for run, steps in runs):
        return _marl_eval(path, digest, runs)
    raise NoTrialsError(
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
    records = []
    metrics: dict[str, None] = {}
    for number, entry in enumerate(results, 1):
        for name in ("metrics", "env_grid_search"):
            if not isinstance(entry[name], dict):
                raise IndicatorError(
                    f"{path}, record {number}: {name} is {_shown(entry[name])}: should be names "
                    "with values"
                )
        numbers = {
            # A list has a value of each step.
            name: _number(value)
            for name, value in entry["metrics"].items()
            if not isinstance(value, list | dict)
        }
        metrics |= dict.fromkeys(numbers)
        records.append({"algorithm": entry["algorithm"], **entry["env_grid_search"], **numbers})
    if not metrics:
        raise IndicatorError(f"{path}: should have a metric that is one number a record")
    return _table(path, digest, records, [*metrics], _POGEMA_METRICS, "results of POGEMA")


def _runs(value: Any, names: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the names of each run, from the environment on, and what it holds."""
    if len(names) == len(_LEVELS) or not isinstance(value, dict):
        yield names, value
    else:
        for name, entry in value.items():
            yield from _runs(entry, (*names, name))


def _marl_eval(path: Path, digest: str, runs: list[tuple[tuple[str, ...], Any]]) -> Table:
    """Return a record for each run: the means of what its last evaluation measured."""
    records = []
    origins = []
    metrics: dict[str, None] = {}
    for names, steps in runs:
        measured = _last_metrics(path, names, steps) if isinstance(steps, dict) else {}
        if not measured:
            raise IndicatorError(
                f"{path}, {_run(names)}: holds no metric, as other runs do: should hold the "
                "metrics of an evaluation at least; a run that failed is no reason to leave it out"
            )
        metrics |= dict.fromkeys(measured)
        records.append({**dict(zip(_LEVELS, names)), **measured})
        origins.append(f"{path}, {_run(names)}")
    table = _table(
        path, digest, records, [*metrics], _RETURNS, "results in the format of marl-eval"
    )
    return replace(table, origins=origins)


def _run(names: tuple[str, ...]) -> str:
    return f"run {' > '.join(names)}"


def _last_metrics(path: Path, run: tuple[str, ...], steps: dict[str, Any]) -> dict[str, Any]:
    """Return what a run's absolute metrics are, or those of its last step where it has none."""
    measured = steps.get("absolute_metrics")
    if not measured:
        logged = {
            name: step
            for name, step in steps.items()
            if isinstance(step, dict) and "step_count" in step
        }
        for name, step in logged.items():
            if not _is_number(step["step_count"]):
                raise IndicatorError(
                    f"{path}, {_run(run)}, {name}: step_count is {_shown(step['step_count'])}: "
                    "should be a number, which says what step is the last"
                )
        measured = max(logged.values(), key=lambda step: step["step_count"], default={})
    entries = measured.items() if isinstance(measured, dict) else []
    return {name: _number(value) for name, value in entries if name not in _COUNTS}


def _number(value: Any) -> Any:
    """Return a number, the mean of a list of numbers, or else what JSON has, which is no number."""
    if isinstance(value, list) and value and all(map(_is_number, value)):
        return sum(value) / len(value)
    return value if _is_number(value) else _shown(value)


def _is_number(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) < _LARGEST


def _shown(value: Any) -> str:
    """Return a value as JSON has it, shortened."""
    try:
        text = json.dumps(value)
    except RecursionError:
        return "a list in lists"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


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
    cells = [[cell_text(record.get(name)) for name in header] for record in records]
    other_metrics = [name for name in metrics if name != performance]
    note = f"These are {kind}: P is {performance}"
    note += "; --column performance=NAME takes another metric." if other_metrics else "."
    return Table(
        str(path), digest, header, cells, range(1, len(cells) + 1), "record", kind,
        {"performance": performance}, frozenset(other_metrics), ".", (note,),
    )  # fmt: skip
