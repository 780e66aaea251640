"""Plays the studies of requests that end, of orders and of a day, and writes their tables.

    python -m research.play_orders

It writes three blocks of docs/environment.md. What is played is kept, as by `play_tables`.
"""

from collections.abc import Iterator

from research.play_tables import OUT
from research.tables import ROOT, example, play, rewrite, seeds_from, table
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

PAGE = ROOT / "docs" / "environment.md"
NEVER, TIMED = "One request until it is served", "Put back after 60 s"  # titles of the study


def robustness_by_rule(results: StudyResults) -> str:
    """Return a table of R by policy and fault, with requests that last and with those that end."""
    values: dict[tuple[str, str], dict[str, str]] = {}
    for verdict in results.verdicts:
        compared = verdict.compared
        title, _, who = compared.table.partition(", ")
        fault = who or compared.changed.setting.name
        values.setdefault((compared.policy, fault), {})[title] = ratio(verdict)
    rows = [
        (f"`{policy}`", fault, rules[NEVER], rules[TIMED])
        for (policy, fault), rules in values.items()
    ]
    heading = ("policy", "two robots in", f"R, {NEVER.lower()}", f"R, {TIMED.lower()}")
    return table(heading, rows, f"{seeds_from(results)}; 95 % intervals.")


def ratio(verdict: Verdict) -> str:
    """Return an indicator with its interval."""
    return section.bracketed(verdict.estimate, 2) if verdict.estimate else section.NOTHING


def on_time(results: StudyResults) -> str:
    """Return a table of what each policy serves in time, by fault."""
    heading = ("policy", "two robots in", "orders on time", "share on time", "95 % late by at most")
    return table(heading, _served(results.cells), f"{seeds_from(results)}; 95 % intervals.")


def _served(cells: tuple[Cell, ...]) -> Iterator[tuple[str, ...]]:
    for cell in cells:
        share = cell.mean_of("share_on_time") or 0.0
        late = cell.mean_of("p95_tardiness") or 0.0
        fault = cell.words.removesuffix(", m = 2")
        p = section.mean_p(cell)
        yield f"`{cell.policy}`", fault, p, f"{100.0 * share:.0f} %", f"{late:.0f} s"


def main() -> None:
    """Play the studies, and rewrite their tables."""
    (timeout,) = play([example(OUT, "request_timeout")])
    (orders,) = play([Study.preset("orders", out=OUT / "orders")])
    (day,) = play([Study.preset("day", out=OUT / "day")])
    rewrite(
        PAGE,
        {
            "request timeout": robustness_by_rule(timeout),
            "orders": on_time(orders),
            "day": on_time(day),
        },
    )


if __name__ == "__main__":
    main()
