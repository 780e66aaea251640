"""Plays the studies behind docs/results.md and writes its tables: `python -m research.play_tables`.

The CSV files in docs/results, from which the README's numbers and picture follow, are written with
them, and the scores that `judge` ranks beside. What is played is kept, so that a second call plays
nothing, and one after an interruption the remaining runs. Costs are not measured here: their table
is written from what `make benchmark` left, if it did.
"""

import json
import math
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from more_itertools import map_reduce

from research import front_page
from research.play_benchmark import benchmark_blocks, benchmark_studies
from research.play_paper import (
    claim_rows,
    draw_figures,
    paper_block,
    paper_studies,
    sentences_block,
)
from research.tables import (
    ROOT,
    block_rows,
    by_policy,
    example,
    interval_in,
    play,
    rewrite,
    seeds_from,
    table,
    write_rows,
)
from swarm_logistics_env.spi.summaries import Interval, t_interval
from swarm_logistics_env.study.report import drawing, section
from swarm_logistics_env.study.report.points import Point
from swarm_logistics_env.study.report.tables import contacts_text
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

PAGE = ROOT / "docs" / "results.md"
RESULTS = ROOT / "docs" / "results"
MEDIA = ROOT / "docs" / "media"
OUT = ROOT / "results" / "tables"
BENCHMARK = ROOT / "results" / "benchmark" / "benchmark.json"
# Nothing was fitted, tuned or chosen on the seeds of these tables: defaults were fitted on those
# from 0 on; recipes and medians were chosen on some from 700,000 and from 1,000,000 on.
FIRST_SEED = 20_000
# Studies in examples/ that are tables of the page.
EXAMPLES = (
    "clearing", "ladder", "ladder_restocked", "ladder_realistic", "leans", "shipped_policies",
    "robust_policy", "broken_robots",
)  # fmt: skip
ESTIMATES = (
    "study", "row", "policy", "value", "low", "high", "threshold", "digits", "seeds", "collapsed",
)  # fmt: skip
COSTS = ("microseconds_per_step", "processor")


def policies_block(results: StudyResults) -> str:
    """Return P and the indicators of every policy."""
    seeds = f"{seeds_from(results)}, of each training."
    return by_policy(
        results.policies, varied_cells(results), results.verdicts, section.ratio, seeds
    )


def varied_cells(results: StudyResults) -> list[Cell]:
    """Return the cells that vary the swarm's size or a parameter."""
    return [cell for cell in results.cells if cell.arm.setting.kind in ("size", "parameter")]


def robust_block(results: StudyResults) -> str:
    """Return R and FT under each failure mode, and what Holm's method makes of them."""
    rows = []
    by_answer: dict[str, list[str]] = {}
    by_label: dict[str, list[Verdict]] = map_reduce(
        results.verdicts, lambda verdict: verdict.compared.label
    )
    for label, tests in by_label.items():
        cell = tests[0].cells[tests[0].compared.changed]
        by_symbol = {test.compared.indicator: test for test in tests}
        row = [label, section.mean_p(cell), contacts_text(cell)]
        for symbol in ("R", "FT"):
            test = by_symbol[symbol]
            row.append(f"{section.ratio(test)}, {test.in_words}")
            answer = test.on_property.adjusted
            by_answer.setdefault(answer, []).append(f"{symbol} under {label}")
        rows.append(row)
    summary = "; ".join(f"{word}: {section.join_names(tests)}" for word, tests in by_answer.items())
    return table(
        ("", "P", "contacts a robot-minute", "R above 0?", "FT above 0?"),
        rows,
        f"`{results.policies[0]}`, {seeds_from(results, 'seeds of each')}; verdicts by Holm's "
        f"method. {summary[:1].upper()}{summary[1:]}.",
    )


def clearing_block(results: StudyResults) -> str:
    """Return the time to clear of every policy and condition: a row a policy."""
    settings = dict.fromkeys(cell.arm.setting for cell in results.cells if cell.n_seeds)
    cells = {(cell.policy, cell.arm.setting): cell for cell in results.cells}
    rows = [
        (f"`{policy}`", *(section.time_to_clear(cells[policy, setting]) for setting in settings))
        for policy in results.policies
    ]
    limit = results.plan.cases[0].scenario.duration
    return table(
        ("", *settings),
        rows,
        "Median time until all items are delivered [s], with its 95 % interval: less is better; N "
        f"is 25; {seeds_from(results)}; of several trainings the mean. "
        f'"x of y": so many runs were not done after {limit:g} s.',
    )


def ablation_cells(results: StudyResults) -> dict[str, dict[str, Cell]]:
    """Return the cells of each table of ablations, by policy."""
    titles = dict.fromkeys(ablation.title for ablation in results.plan.specification.ablations)
    return {
        title: {cell.arm.setting.name: cell for cell in results.cells if cell.table == title}
        for title in titles
    }


def ladder_block(cleared: StudyResults, restocked: StudyResults) -> str:
    """Return a row for each rung: its time to clear and P, and what it adds to the one before."""
    times = ablation_cells(cleared)
    gains = ablation_cells(restocked)
    rungs = cleared.policies
    rows = []
    for rung, previous in zip(rungs, ("", *rungs)):
        if rung.startswith("ppo-"):
            previous = ""
        elif rung == "central":
            previous = "homing"
        row = [f"`{rung}`"]
        for title, cells in gains.items():
            p = section.mean_p(cells[rung])
            if previous:
                gain = t_interval(cells[rung].by_seed - cells[previous].by_seed)
                sign = "" if gain.value < 0 else "+"
                p += f" ({sign}{section.bracketed(gain, 1)})"
            row += [section.time_to_clear(times[title][rung]), p]
        rows.append(row)
    kinds = "time to clear [s]", "P where items come back"
    head = ("", *(f"{kind}, {title}" for title in times for kind in kinds))
    return table(head, rows, f"{seeds_from(cleared)}.")


def realistic_block(results: StudyResults) -> str:
    """Return P, contacts and P over that of the best local script, a row a policy."""
    (cells,) = ablation_cells(results).values()
    best = best_script(cells)
    shares = shares_of_script(results, best)
    rows = []
    for policy, cell in cells.items():
        share = section.bracketed(shares[policy], 2, [1.0]) if policy in shares else ""
        contacts = section.bracketed(cell.contacts, 2)
        rows.append((f"`{policy}`", section.mean_p(cell), share, contacts))
    return table(
        ("", "P", f"times P of `{best}`", "contacts a robot-minute"),
        rows,
        f"{seeds_from(results)}, of each training. `{best}` is the best of these scripts that "
        "sense what is near; `central` and `central-stock` see everything.",
    )


def best_script(cells: Mapping[str, Cell]) -> str:
    """Return the script with the most deliveries of those that sense what is near."""
    local = [policy for policy in cells if not policy.startswith(("ppo-", "central"))]
    return max(local, key=lambda policy: cells[policy].mean.value)


def shares_of_script(results: StudyResults, script: str) -> dict[str, Interval]:
    """Return by which factor each studied policy delivers more than a script, by the change."""
    shares = {}
    for verdict in results.verdicts:
        if verdict.after.name == script and verdict.interval is not None:
            change = verdict.interval
            low = None if change.high is None else _factor(change.high)
            high = None if change.low is None else _factor(change.low)
            shares[verdict.compared.policy] = Interval(_factor(change.value), low, high)
    return shares


def _factor(change: float) -> float:
    """Return by which factor P was larger before a relative change; infinite: nothing is left."""
    return 1.0 / (1.0 + change) if change > -1.0 else math.inf


def leans_cells(results: StudyResults) -> dict[str, dict[str, Cell]]:
    """Return the cells of each world, by policy."""
    worlds = ablation_cells(results)
    for fault in results.plan.specification.faults:
        worlds[fault.title] = {
            cell.policy: cell
            for cell in results.cells
            if cell.table == fault.title and cell.arm.setting.name in fault.modes
        }
    return worlds


def leans_block(results: StudyResults) -> str:
    """Return a row for each world: P of every policy."""
    rows = [
        (title, *(_p_and_stalls(cells[policy]) for policy in results.policies))
        for title, cells in leans_cells(results).items()
    ]
    return table(
        ("", *(f"`{policy}`" for policy in results.policies)),
        rows,
        "P, items delivered in 500 s by 25 robots, with 95 % intervals; "
        f"{seeds_from(results)}, of each training.",
    )


def _p_and_stalls(cell: Cell) -> str:
    p = section.mean_p(cell)
    return f"{p}; {cell.stalled:.0%} stalled" if cell.stalled else p


def draw_ladder(path: Path) -> None:
    """Draw P of each rung with its interval, without and with a handling time, of the table."""
    worlds = "lifting takes no time", "lifting takes 1 s"
    rows = []
    for rung, _, at_once, _, in_a_second in block_rows(PAGE, "ladder"):
        points = [
            Point(world, style, "", *interval_in(text), decided=True)
            for style, (world, text) in enumerate(zip(worlds, (at_once, in_a_second)))
        ]
        rows.append((rung, points))
    picture = partial(drawing.forest, columns={"P in 500 s where items come back [items]": rows})
    note = "Means, of each training; bars: 95 % intervals."
    path.write_text(drawing.svg_image(picture, 2.9, note), encoding="utf-8")


def costs_block(costs: Mapping[str, Any]) -> str:
    """Return the table of what `make benchmark` measured: its benchmark.json."""
    rows = [
        (
            f"{row['name']}: {row['includes']}",
            f"{row['agent_steps_per_second']:,.0f}",
            f"{row['microseconds_per_step']:,.0f}",
            f"{row['cost_to_base']:.2f} x {row['base']}" if row["base"] else "",
        )
        for row in costs["contestants"]
    ]
    machine = costs["machine"]
    seconds = costs["seconds"]
    return table(
        ("", "agent-steps per s", "us per step", "cost per agent-step"),
        rows,
        "Cost: less is better; the median over rounds of the ratio in each.",
        f"On {machine['processor']}, {machine['cores']} cores, Python {machine['python']}.",
        f"A second process takes its first step after {seconds['first_step']:.1f} s.",
        f"In an empty directory `judge homing` shows P after {seconds['judge homing, P']:.0f} s, "
        f"and its first look at all questions after {seconds['judge homing, first look']:.0f} s.",
    )


def estimate_rows(
    policies: StudyResults,
    clearing: StudyResults,
    realistic: StudyResults,
    leans: StudyResults,
    broken: StudyResults,
) -> Iterator[tuple[object, ...]]:
    """Yield the numbers of five tables, with the columns ESTIMATES."""

    def row(
        study: str,
        label: str,
        policy: str,
        interval: Interval,
        digits: int,
        threshold: object = "",
        trainings: object = "",
    ) -> tuple[object, ...]:
        name = policy.partition(", ")[0]  # without how many trainings it stands for
        return study, label, name, *interval, threshold, digits, n_seeds, trainings

    n_seeds = len(policies.plan.seeds)
    for cell in varied_cells(policies):
        digits = section.digits_of(cell.mean.value)
        yield row("policies", f"P, {cell.words}", cell.policy, cell.mean, digits)
    for test in policies.verdicts:
        if test.interval:
            label = f"{test.compared.indicator}, {test.compared.label}"
            policy = test.compared.policy
            threshold = test.compared.threshold
            trainings = (test.estimate and test.estimate.collapsed) or ""
            yield row("policies", label, policy, test.interval, 3, threshold, trainings)
    n_seeds = len(clearing.plan.seeds)
    for cell in clearing.cells:
        if cell.n_seeds:
            interval = section.interval_to_clear(cell)
            yield row("clearing", str(cell.arm.setting), cell.policy, interval, 0)
    n_seeds = len(realistic.plan.seeds)
    (cells,) = ablation_cells(realistic).values()
    for policy, cell in cells.items():
        yield row("realistic", "P", policy, cell.mean, section.digits_of(cell.mean.value))
        yield row("realistic", "contacts", policy, cell.contacts, 2)
    for policy, share in shares_of_script(realistic, best_script(cells)).items():
        yield row("realistic", front_page.SHARE, policy, share, 2, 1.0)
    n_seeds = len(leans.plan.seeds)
    for title, cells in leans_cells(leans).items():
        for policy in leans.policies:
            mean = cells[policy].mean
            yield row("leans", title, policy, mean, section.digits_of(mean.value))
    n_seeds = len(broken.plan.seeds)
    for cell in broken.cells:
        digits = section.digits_of(cell.mean.value)
        yield row("broken", str(cell.arm.setting), cell.policy, cell.mean, digits)
        yield row("broken", f"contacts, {cell.arm.setting}", cell.policy, cell.contacts, 1)


def main() -> None:
    """Play, rewrite the page of results and the files beside it, then the README."""
    paper = play(paper_studies(OUT, FIRST_SEED))
    draw_figures(paper, MEDIA)
    clearing, cleared, restocked, realistic, leans, policies, robust, broken = play(
        example(OUT, name) for name in EXAMPLES
    )
    blocks = {
        "clearing": clearing_block(clearing),
        "paper": paper_block(paper),
        "sentences": sentences_block(paper),
        "ladder": ladder_block(cleared, restocked),
        "realistic": realistic_block(realistic),
        "leans": leans_block(leans),
        "policies": policies_block(policies),
        "robust": robust_block(robust),
        **benchmark_blocks(play(benchmark_studies(OUT))),
    }
    estimates = estimate_rows(policies, clearing, realistic, leans, broken)
    write_rows(RESULTS / "estimates.csv", ESTIMATES, estimates)
    write_rows(RESULTS / "claims.csv", ("subject", "claim", "verdict"), claim_rows(paper))
    if BENCHMARK.exists():
        costs = json.loads(BENCHMARK.read_text(encoding="utf-8"))
        blocks["costs"] = costs_block(costs)
        (step,) = (row for row in costs["contestants"] if row["name"] == "env.step_arrays")
        row = (step["microseconds_per_step"], costs["machine"]["processor"])
        write_rows(RESULTS / "cost.csv", COSTS, [row])
    rewrite(PAGE, blocks)
    draw_ladder(MEDIA / "ladder.svg")
    front_page.main()


if __name__ == "__main__":
    main()
