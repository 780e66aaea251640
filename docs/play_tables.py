"""Plays the studies behind docs/results.md and writes its tables: `python docs/play_tables.py`.

From these tables follow the README's numbers and picture; `judge` gets what it ranks beside.

What is played is kept, so that a second call plays nothing, and one after an interruption the rest.
Costs are not measured here: their table is written from what `make benchmark` left, if it did.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import front_page
from tables import rewritten, table

from swarm_logistics_env import policies
from swarm_logistics_env.cli.judging import RECORDED, STUDY
from swarm_logistics_env.report import section
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparison import NO_FAULT, Setting
from swarm_logistics_env.studies.measures import agreement
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import UNAFFECTED, Cell, Verdict, grouped

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
    all_cells = [cell for part in parts for cell in part.cells]
    kinds = ["size", "fault", "parameter"]
    counted = [cell for cell in all_cells if cell.counted]
    counted.sort(key=lambda cell: kinds.index(cell.arm.setting.kind))
    cells = {one: here[0] for one, here in grouped(counted, lambda c: c.arm.setting).items()}
    figure = agreement("", list(cells.values()))
    missed = {cell.arm.setting for cell in figure.misses or ()}
    rows = [
        _row(label, [cells[level] for level in levels], missed)
        for label, levels in _paper_rows(cells)
    ]
    rows += [
        (f"without taxis, N = {cell.arm.setting.value:g}", "", *_ours([cell]))
        for cell in all_cells
        if cell.arm.setting.name == "random-walk"
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
    if figure.met is not None:
        lines.append(
            f"{len(figure.met)} of {len(figure.cells)} lie inside the 95 % interval of our mean; "
            f"{len(figure.cells) - len(missed)} lie inside the 95 % prediction interval of one of "
            f"our runs, whose mean width is {figure.mean_interval_width:.1f} items (the others are "
            "bold). The second count is a weak test: quite different controllers pass it as well."
        )
    if any(cell.saturated for cell in counted):
        lines.append(
            f"{section.SATURATED}: in some run every item was delivered, so this P is capped and "
            "what rests on it as well."
        )
    return "\n".join([*lines, "", *_claims([test for part in parts for test in part.verdicts])])


def _paper_rows(cells: Mapping[Setting, Cell]) -> list[tuple[str, list[Setting]]]:
    """Return the rows: a label, and the levels that stand side by side in it."""
    rows = []
    for levels in grouped(cells, lambda level: level.name).values():
        width = len(levels) if len(levels) <= 4 else 3
        for start in range(0, len(levels), width):
            some = levels[start : start + width]
            rows.append((_label(some, cells[some[0]]), some))
    return rows


def _label(levels: list[Setting], first: Cell) -> str:
    values = ", ".join(f"{level.value:g}" for level in levels)
    kind, name = levels[0].kind, levels[0].name
    if kind == "size":
        return f"N = {values} ({first.arm.case.scenario.model_dump()['n_items']} items)"
    if kind == "parameter":
        return f"{name} = {values}" + (" m" if name.endswith("_width") else "")
    return f"{_FAULTS[name]}, m = {values}" if levels[0].value else "no fault"


def _row(label: str, cells: list[Cell], missed: set[Setting]) -> tuple[str, ...]:
    published = [
        f"**{cell.published:g}**" if cell.arm.setting in missed else f"{cell.published:g}"
        for cell in cells
    ]
    return label, ", ".join(published), *_ours(cells)


def _ours(cells: list[Cell]) -> tuple[str, str]:
    seeds = dict.fromkeys(str(cell.n_seeds) for cell in cells)
    return ", ".join(map(section.mean_p, cells)), ", ".join(seeds)


def _claims(tests: list[Verdict]) -> list[str]:
    """Return how many claims of the paper's text are supported, and which are not."""
    claims = [test for test in tests if test.claim]
    counted = section.counted(section.counted_as(one, one.claim_verdict_holm) for one in claims)
    text = (
        f"Of {len(claims)} claims (those of the paper's text, and that P falls without taxis), "
        f"adjusted after Holm: {counted}."
    )
    refuted = [
        f"{test.claim}, {test.compared.label}"
        for test in claims
        if section.counted_as(test, test.claim_verdict_holm) == "refuted"
    ]
    return [text, *([f"Refuted: {'; '.join(refuted)}."] if refuted else [])]


# -- the table of policies ----------------------------------------------------------------------


def policies_block(results: StudyResults, skewed: StudyResults) -> str:
    """Return P and the indicators of every policy, those of `skewed` in place of the others."""
    names = results.policies
    rows: dict[str, dict[str, str]] = {}
    for cell in results.cells:
        if cell.arm.setting.kind in ("size", "parameter"):
            rows.setdefault(f"P, {cell.words}", {})[cell.policy] = section.mean_p(cell)
    for test in (*results.verdicts, *skewed.verdicts):
        mark = _EXACT if test.plain == UNAFFECTED else ""
        rows.setdefault(_asked(test), {})[test.compared.policy] = section.ratio(test) + mark
    first, count, more = results.plan.seeds[0], len(results.plan.seeds), len(skewed.plan.seeds)
    replaced = list(dict.fromkeys(map(_asked, skewed.verdicts)))
    fewer = [f"`{name}`" for name in skewed.policies]
    text = (
        f"{count} seeds from {first:,} on; {more} for "
        f"{section.listed(replaced)} of {section.listed(fewer)}, whose P is skewed there."
    )
    head = ("", *(f"`{name}`" for name in names))
    body = [(label, *(row.get(name, "") for name in names)) for label, row in rows.items()]
    if any(test.plain == UNAFFECTED for test in results.verdicts):
        text += (
            f"\nThe sign{_EXACT} marks what is {section.UNAFFECTED}: equal runs, an exact value, "
            "and no evidence."
        )
    return "\n".join([table(head, body), "", text])


def _asked(test: Verdict) -> str:
    return f"{test.compared.indicator}, {test.compared.label}"


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


# -- what `judge` ranks a policy beside ---------------------------------------------------------


def record_scores(out: Path) -> None:
    """Record P of the shipped swarms in the study of `judge`; one that needs the state is none."""
    loaded = {name: policies.load(name) for name in policies.NAMES}
    names = [name for name, one in loaded.items() if not getattr(one, "needs_state", False)]
    study = Study.preset(STUDY, out=out / STUDY, policies=names)
    (found,) = play([study])
    p = {c.policy: {"p": c.by_seed.tolist()} for c in found.cells if c.arm.setting == NO_FAULT}
    seeds = [found.plan.seeds[0], found.plan.seeds[-1]]
    recorded = {"command": "python docs/play_tables.py", "seeds": seeds, "policies": p}
    RECORDED.write_text(json.dumps(recorded) + "\n", encoding="utf-8")


def main() -> None:
    """Play, rewrite the page of results, then the README, and record P of the shipped swarms."""
    blocks = {
        "paper": paper_block(play(paper_studies(OUT))),
        "policies": policies_block(*play(policy_studies(OUT))),
    }
    if BENCHMARK.exists():
        blocks["costs"] = costs_block(json.loads(BENCHMARK.read_text(encoding="utf-8")))
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    front_page.main()
    record_scores(OUT)


if __name__ == "__main__":
    main()
