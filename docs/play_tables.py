"""Plays the studies behind docs/results.md and writes its tables: `python docs/play_tables.py`.

From these tables follow the README's numbers and picture, and `judge` gets its score cards.

What is played is kept, so that a second call plays nothing, and one after an interruption the rest.
Costs are not measured here: their table is written from what `make benchmark` left, if it did.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import front_page
import pandas as pd
import score_cards
from tables import rewritten, table

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.indicator_table import Finding
from swarm_logistics_env.studies.performance_table import Cell, rows_of
from swarm_logistics_env.studies.policy_comparison import agreement, judged_policies
from swarm_logistics_env.studies.results import StudyResults

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results.md"
OUT = ROOT / "results" / "tables"
BENCHMARK = ROOT / "results" / "benchmark" / "benchmark.json"
# No seed from here on was used to fit, train, tune or choose anything: defaults were fitted on the
# seeds from 0 on, trainings evaluate on those from 1,000,000 on.
FIRST_SEED = 20_000
SEEDS, SEEDS_WHERE_SKEWED = 20, 100
PROCESSES = os.cpu_count() or 1


def paper_studies(out: Path) -> tuple[Study, ...]:
    """Return the study of the paper in two parts: the faults, where P is skewed, with more seeds.

    No family of claims is divided: FT and R are asked of faults only, S, A and change of the rest.
    """
    return (
        Study.preset("paper", out=out / "paper", seeds=SEEDS, first_seed=FIRST_SEED, faults=()),
        Study.preset(
            "paper",
            out=out / "paper-faults",
            seeds=SEEDS_WHERE_SKEWED,
            first_seed=FIRST_SEED,
            sizes=(),
            parameters=(),
            ablations=(),
        ),
    )


def policy_studies(out: Path) -> tuple[Study, ...]:
    """Return the studies of the shipped policies, those with more seeds last."""
    return tuple(
        Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name)
        for name in ("shipped_policies", "shipped_policies_fm4")
    )


def play(studies: Iterable[Study]) -> list[StudyResults]:
    """Play what is missing of each study; return what the runs say.

    Raises:
        SystemExit: a run failed.
    """
    found = []
    for study in studies:
        tally = study.run(processes=PROCESSES)
        if tally.failed:
            raise SystemExit(f"{tally.failed} runs failed: {tally.error}")
        found.append(study.findings())
    return found


_EXACT = " ="
_FAULTS = {
    "removed": "robots removed",
    "FM1": "FM1 (always tells timer 0)",
    "FM2": "FM2 (never picks up)",
    "FM3": "FM3 (neither sends nor hears)",
    "FM4": "FM4 (delivers nothing)",
}


# -- the paper's table --------------------------------------------------------------------------


def paper_block(parts: list[StudyResults]) -> str:
    """Return the paper's table: P of the paper beside ours, and how well they agree."""
    p = pd.concat([part.performance for part in parts])
    kinds = ["size", "fault", "parameter"]
    counted = p[p["counted"]].sort_values("kind", key=lambda k: k.map(kinds.index), kind="stable")
    counted = counted.drop_duplicates("cell")
    cells = {cell.arm.setting: cell for cell in rows_of(counted)}
    figure = agreement("", counted)
    missed = set() if figure.misses is None else set(figure.misses["cell"])
    rows = [
        _row(label, [cells[level] for level in levels if level in cells], missed)
        for label, levels in _paper_rows(cells)
    ]
    rows += [
        (f"without taxis, N = {cell.n_robots}", "", wording.mean_p(cell), str(cell.n_seeds))
        for cell in rows_of(p[(p["kind"] == "policy") & (p["factor"] == "random-walk")])
    ]
    lines = [
        table(("", "paper's P", "ours, mean [95 %]", "seeds"), rows),
        "",
        f"Seeds from {parts[0].plan.seeds[0]:,} on, on which nothing was fitted.",
    ]
    if figure.mean_log_error is not None:
        lines.append(
            f"The mean of |ln(ours / paper's)| is {figure.mean_log_error:.3f} over the "
            f"{len(figure.cells)} published values."
        )
    if figure.met is not None and figure.misses is not None:
        inside = len(figure.cells) - len(figure.misses)
        lines.append(
            f"{len(figure.met)} of {len(figure.cells)} lie inside the 95 % interval of our mean; "
            f"{inside} lie inside the 95 % prediction interval of one of our runs, whose mean "
            f"width is {figure.mean_interval_width:.1f} items (the others are bold). The second "
            "count is a weak test: quite different controllers pass it as well."
        )
    if counted["saturated"].any():
        lines.append(
            f"{wording.SATURATED}: in some run every item was delivered, so this P is capped and "
            "what rests on it as well."
        )
    lines += ["", *_claims([test for part in parts for test in rows_of(part.indicators)])]
    return "\n".join(lines)


def _paper_rows(cells: Mapping[Setting, Cell]) -> list[tuple[str, list[Setting]]]:
    """Return the rows: a label, and the levels that stand side by side in it."""
    factors: dict[str, list[Setting]] = {}
    for level in cells:
        factors.setdefault(level.name, []).append(level)
    rows = []
    for levels in factors.values():
        width = len(levels) if len(levels) <= 4 else 3
        for start in range(0, len(levels), width):
            some = levels[start : start + width]
            rows.append((_label(some, cells[some[0]].arm.condition.scenario.n_items), some))
    return rows


def _label(levels: list[Setting], n_items: int) -> str:
    values = ", ".join(f"{level.value:g}" for level in levels)
    kind, name = levels[0].kind, levels[0].name
    if kind == "size":
        return f"N = {values} ({n_items} items)"
    if kind == "parameter":
        return f"{name} = {values}" + (" m" if name.endswith("_width") else "")
    return f"{_FAULTS[name]}, m = {values}" if levels[0].value else "no fault"


def _row(label: str, cells: list[Cell], missed: set[str]) -> tuple[str, ...]:
    published = [
        f"**{cell.published:g}**" if cell.cell in missed else f"{cell.published:g}"
        for cell in cells
    ]
    seeds = dict.fromkeys(str(cell.n_seeds) for cell in cells)
    ours = [wording.mean_p(cell) for cell in cells]
    return label, ", ".join(published), ", ".join(ours), ", ".join(seeds)


def _claims(tests: list[Finding]) -> list[str]:
    """Return how many claims of the paper's text are supported, and which are not."""
    claims = [test for test in tests if test.claim]
    if not claims:
        return []
    said = [wording.counted_as(test, test.claim_verdict_holm) for test in claims]
    text = (
        f"Of {len(claims)} claims (those of the paper's text, and that P falls without taxis), "
        f"adjusted after Holm: {wording.counted(Counter(said))}."
    )
    refuted = [
        f"{test.claim}, {test.comparison}"
        for test, verdict in zip(claims, said)
        if verdict == "refuted"
    ]
    return [text, *([f"Refuted: {'; '.join(refuted)}."] if refuted else [])]


# -- the table of policies ----------------------------------------------------------------------


def policies_block(results: StudyResults, skewed: StudyResults) -> str:
    """Return P and the indicators of every policy, those of `skewed` in place of the others."""
    names = judged_policies(results)
    rows: dict[str, dict[str, str]] = {}
    for cell in rows_of(results.performance):
        if cell.kind in ("size", "parameter"):
            rows.setdefault(f"P, {cell.cell}", {})[cell.policy] = wording.mean_p(cell)
    for test in (*rows_of(results.indicators), *rows_of(skewed.indicators)):
        mark = _EXACT if test.verdict == "unaffected" else ""
        label = f"{test.indicator}, {test.comparison}"
        rows.setdefault(label, {})[test.policy] = wording.ratio(test) + mark
    first, count, more = results.plan.seeds[0], len(results.plan.seeds), len(skewed.plan.seeds)
    replaced = dict.fromkeys(f"{j.indicator}, {j.comparison}" for j in rows_of(skewed.indicators))
    fewer = [f"`{name}`" for name in judged_policies(skewed)]
    text = (
        f"{count} seeds from {first:,} on; {more} for "
        f"{wording.listed(list(replaced))} of {wording.listed(fewer)}, whose P is skewed there."
    )
    head = ("", *(f"`{name}`" for name in names))
    body = [(label, *(row.get(name, "") for name in names)) for label, row in rows.items()]
    if (results.indicators["verdict"] == "unaffected").any():
        text += (
            f"\nThe sign{_EXACT} marks what is {wording.UNAFFECTED}: equal runs, an exact value, "
            "and no evidence."
        )
    return "\n".join([table(head, body), "", text, *_beside_homing(results)])


def _beside_homing(results: StudyResults) -> list[str]:
    """Return a sentence: how much less or more than the script `homing` the networks deliver."""
    p = results.performance
    unbroken = {cell.policy: cell for cell in rows_of(p[p["factor"] == "none"])}
    networks = [name for name in unbroken if name.startswith("ppo-")]
    if "homing" not in unbroken or not networks:
        return []
    told = []
    for name in networks:
        change = spi.relative_change(unbroken["homing"].by_seed, unbroken[name].by_seed)
        sign, word = (-1.0, "less") if change.value < 0.0 else (1.0, "more")
        limits = ""
        if change.low is not None and change.high is not None:
            low, high = sorted((100 * sign * change.low, 100 * sign * change.high))
            limits = f" [{low:.1f}, {high:.1f}]"
        told.append(f"`{name}` {100 * abs(change.value):.1f} %{limits} {word}")
    robots = unbroken["homing"].n_robots
    text = (
        f"Compared with the script `homing`, at N = {robots} without faults and paired by seed, "
        f"the networks deliver: {', '.join(told)}."
    )
    return ["", text]


# -- the table of costs -------------------------------------------------------------------------


def costs_block(found: Mapping[str, Any]) -> str:
    """Return the table of what `make benchmark` measured: its benchmark.json."""
    rows = [
        (
            f"{row['name']}: {row['includes']}",
            f"{row['agent_steps_per_second']:,.0f}",
            f"{row['microseconds_per_step']:,.0f}",
            f"{row['cost_to_base']:.2f} x {row['base']}" if row["base"] else "",
        )
        for row in found["contestants"]
    ]
    machine = found["machine"]
    lines = [
        table(("", "agent-steps per s", "us per step", "cost per agent-step"), rows),
        "",
        f"On {machine['processor']}, {machine['cores']} cores, Python {machine['python']}.",
    ]
    if "first_step" in found.get("seconds", {}):
        lines.append(
            f"A second process takes its first step after {found['seconds']['first_step']:.1f} s."
        )
    return "\n".join(lines)


def main() -> None:
    """Play, rewrite the page of results, then the README, and record the score cards."""
    blocks = {
        "paper": paper_block(play(paper_studies(OUT))),
        "policies": policies_block(*play(policy_studies(OUT))),
    }
    if BENCHMARK.exists():
        blocks["costs"] = costs_block(json.loads(BENCHMARK.read_text(encoding="utf-8")))
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    front_page.main()
    score_cards.main()


if __name__ == "__main__":
    main()
