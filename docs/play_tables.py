"""Plays the studies behind docs/results.md and writes its tables: `python docs/play_tables.py`.

From these tables follow the README's numbers and picture; `judge` gets what it ranks beside.

What is played is kept, so that a second call plays nothing, and one after an interruption the rest.
Costs are not measured here: their table is written from what `make benchmark` left, if it did.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import front_page
from play_ladder import draw_ladder, ladder_block, ladder_studies, leans_block
from play_paper import draw_figures, paper_block, paper_studies, sentences_block
from tables import rewritten, table

from swarm_logistics_env.cli.judging import ENTRIES, RECORDED, STUDY
from swarm_logistics_env.policies import NAMES, load
from swarm_logistics_env.report import benchmark, section
from swarm_logistics_env.spi import median_interval
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparison import NO_FAULT
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import UNAFFECTED, Verdict, grouped

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "results.md"
MEDIA = ROOT / "docs" / "media"
OUT = ROOT / "results" / "tables"
BENCHMARK = ROOT / "results" / "benchmark" / "benchmark.json"
# No seed from here on was used to fit, train, tune or choose anything: defaults were fitted on the
# seeds from 0 on, trainings evaluate on those from 1,000,000 on.
FIRST_SEED = 20_000
PROCESSES = os.cpu_count() or 1


def policy_studies(out: Path) -> tuple[Study, ...]:
    """Return the studies of the shipped policies, and of `ppo-robust` under three failed robots."""
    return tuple(
        Study.from_file(ROOT / "examples" / f"{name}.toml", out=out / name)
        for name in ("shipped_policies", "robust_policy")
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

# -- the table of policies ----------------------------------------------------------------------


def policies_block(results: StudyResults) -> str:
    """Return P and the indicators of every policy."""
    names = results.policies
    rows: dict[str, dict[str, str]] = {}
    for cell in results.cells:
        if cell.arm.setting.kind in ("size", "parameter"):
            rows.setdefault(f"P, {cell.words}", {})[cell.policy] = section.mean_p(cell)
    for test in results.verdicts:
        mark = _EXACT if test.plain == UNAFFECTED else ""
        rows.setdefault(_asked(test), {})[test.compared.policy] = section.ratio(test) + mark
    first, count = results.plan.seeds[0], len(results.plan.seeds)
    text = (
        f"{count} seeds from {first:,} on, of each training. Each "
        "interval is of 95 % by itself; verdicts are not shown. A divides by the relative change "
        "of the parameter, which is 4 from 0.02 to 0.1: there A = 0.96 is 16 % fewer items."
    )
    head = ("", *(f"`{name}`" for name in names))
    body = [(label, *(row.get(name, "") for name in names)) for label, row in rows.items()]
    if any(test.plain == UNAFFECTED for test in results.verdicts):
        text += (
            f"\nThe sign{_EXACT} marks what is {section.UNAFFECTED}: equal runs, an exact value, "
            "and no evidence."
        )
    return "\n".join([table(head, body), "", text])


def robust_block(results: StudyResults) -> str:
    """Return R and FT under each failure mode, and what Holm's method makes of them."""
    rows, told = [], dict[str, list[str]]()
    for label, tests in grouped(results.verdicts, lambda one: one.compared.label).items():
        cell = results.cells_of(tests[0].compared)[tests[0].compared.changed]
        by_symbol = {test.compared.indicator: test for test in tests}
        words = {one: section.said(by_symbol[one].conclusion) for one in ("R", "FT")}
        said = [f"{section.ratio(by_symbol[one])}, {word}" for one, word in words.items()]
        rows.append((label, section.mean_p(cell), *said))
        for symbol, word in words.items():
            told.setdefault(word, []).append(f"{symbol} under {label}")
    found = "; ".join(f"{words}: {section.listed(what)}" for words, what in told.items())
    seeds, name = results.plan.seeds, results.policies[0]
    text = (
        f"`{name}`, {len(seeds)} seeds of each from {seeds[0]:,} on; verdicts by Holm's method. "
        f"{found[:1].upper()}{found[1:]}."
    )
    return "\n".join([table(("", "P", "R above 0?", "FT above 0?"), rows), "", text])


def _asked(test: Verdict) -> str:
    return f"{test.compared.indicator}, {test.compared.label}"


# -- the table of clearing ----------------------------------------------------------------------


def clearing_study(out: Path) -> Study:
    """Return the study of how fast the shipped swarms clear the paper's warehouse."""
    return Study.from_file(ROOT / "examples" / "clearing.toml", out=out / "clearing")


def clearing_block(results: StudyResults) -> str:
    """Return the time to clear of every policy and condition: a row a policy."""
    settings = list(dict.fromkeys(cell.arm.setting for cell in results.cells if cell.n_seeds))
    by_place = {(cell.policy, cell.arm.setting): cell for cell in results.cells}
    rows = [
        (f"`{policy}`", *(section.time_to_clear(by_place[policy, one]) for one in settings))
        for policy in results.policies
    ]
    head = ("", *(str(one) for one in settings))
    seeds = results.plan.seeds
    limit = results.plan.cases[0].scenario.duration
    text = (
        "Median time until all items are delivered [s], with its 95 % interval: less is better; N "
        f"is 25; {len(seeds)} seeds from {seeds[0]:,} on; of several trainings the mean. "
        f'"x of y": so many runs were not done after {limit:g} s.'
    )
    medians = {
        policy: median_interval(
            [run.time_to_clear for run in by_place[policy, settings[0]].outcomes]
        )
        for policy in results.policies
    }
    fastest = min(medians, key=lambda policy: medians[policy].value)
    if not fastest.startswith("ppo-"):
        text += (
            f"\nWithout a failure the script `{fastest}` is the fastest, "
            f"with {medians[fastest].value:.0f} s."
        )
    learned = [policy for policy in medians if policy.startswith("ppo-robust")]
    if learned and {"swarm-dt", "homing", "homing-stock"} <= medians.keys():
        slow, fast = medians["swarm-dt"].value, medians[learned[0]].value
        saved = {one: slow - medians[one].value for one in ("homing", "homing-stock")}
        shares = [f"`{one}` {s:.0f} s ({s / (slow - fast):.0%})" for one, s in saved.items()]
        text += (
            f"\n`ppo-robust` is {slow - fast:.0f} s faster than `swarm-dt`. Two "
            f"scripts, which learned nothing, save most of that: {' and '.join(shares)}. Of the "
            "deliveries where items come back they reach [less](#what-the-scripts-owe-to-what)."
        )
    return "\n".join([table(head, rows), "", text])


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
        "Cost: less is better; the median over rounds of the ratio in each.",
        f"On {machine['processor']}, {machine['cores']} cores, Python {machine['python']}.",
    ]
    if "first_step" in found.get("seconds", {}):
        lines.append(
            f"A second process takes its first step after {found['seconds']['first_step']:.1f} s."
        )
    return "\n".join(lines)


# -- the benchmark ------------------------------------------------------------------------------

ENTRANTS = (
    "swarm-dt", "swarm-dt-follow", "homing", "homing-stock", "central", "central-stock",
    "ppo-delivery@all", "ppo-robust@all", "ppo-indicator@all",
)  # fmt: skip
# Other people's learners, where `make interop` has trained them; each in its largest world.
LEARNERS = ("sb3-ppo-paper", "benchmarl-ippo-paper", "torchrl-ppo-small", "benchmarl-mappo-small")


def benchmark_studies(out: Path) -> tuple[Study, ...]:
    """Return the benchmark's study of each entrant, each in a directory of its own."""
    files = [ROOT / "results" / "interop" / f"{name}@all.safetensors" for name in LEARNERS]
    there = [str(path) for path in files if path.with_stem(path.stem[:-3] + "0").exists()]
    return tuple(
        Study.preset(
            benchmark.STUDY, out=out / "benchmark" / section.slug(Path(name).stem), policies=[name]
        )
        for name in (*ENTRANTS, *there)
    )


def benchmark_block(found: Sequence[StudyResults]) -> str:
    """Return the leaderboard and every entrant's worst cell; note the scores for `judge`."""
    scores = {one.policies[0]: benchmark.score(one) for one in found}
    ENTRIES.write_text(json.dumps({name: one.tolist() for name, one in scores.items()}) + "\n")
    board = benchmark.leaderboard(scores)
    worst = {}
    for results in found:
        test, share = benchmark.worst(results)
        worst[results.policies[0]] = f"{test.compared.table}, {test.after}: {share:.0%}"
    rows = [(f"`{name}`", *rest, worst[name]) for name, *rest in board.rows]
    head = (*board.columns, "worst cell, share of P without it")
    seeds = found[0].plan.seeds
    text = f"{len(seeds)} seeds from {seeds[0]:,} on, of each training. {' '.join(board.lines)}"
    return "\n".join([table(head, rows), "", text])


# -- what `judge` ranks a policy beside ---------------------------------------------------------


def record_scores(out: Path) -> None:
    """Record P of the shipped swarms in the study of `judge`; one that needs the state is none."""
    loaded = {name: load(name) for name in NAMES if "@" not in name}
    names = [name for name, one in loaded.items() if not getattr(one, "needs_state", False)]
    # Of that study the sound swarm alone is recorded, so one fault is enough.
    fault = {"modes": ["FM1"], "robots": [1]}
    study = Study.preset(
        STUDY, out=out / STUDY, policies=names, sizes=(), parameters=(), faults=[fault]
    )
    (found,) = play([study])
    p = {c.policy: {"p": c.by_seed.tolist()} for c in found.cells if c.arm.setting == NO_FAULT}
    seeds = [found.plan.seeds[0], found.plan.seeds[-1]]
    recorded = {"command": "python docs/play_tables.py", "seeds": seeds, "policies": p}
    RECORDED.write_text(json.dumps(recorded) + "\n", encoding="utf-8")


def main() -> None:
    """Play, rewrite the page of results, then the README, and record P of the shipped swarms."""
    paper = play(paper_studies(OUT, FIRST_SEED))
    draw_figures(paper, MEDIA)
    cleared, restocked, leans = play(ladder_studies(OUT))
    draw_ladder(restocked, MEDIA / "ladder.svg")
    policies, robust = play(policy_studies(OUT))
    entered = play(benchmark_studies(OUT))
    blocks = {
        "clearing": clearing_block(*play([clearing_study(OUT)])),
        "paper": paper_block(paper),
        "sentences": sentences_block(paper),
        "ladder": ladder_block(cleared, restocked),
        "leans": leans_block(leans),
        "policies": policies_block(policies),
        "robust": robust_block(robust),
        "benchmark": benchmark_block(entered),
    }
    if BENCHMARK.exists():
        blocks["costs"] = costs_block(json.loads(BENCHMARK.read_text(encoding="utf-8")))
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    front_page.main()
    record_scores(OUT)


if __name__ == "__main__":
    main()
