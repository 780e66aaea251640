"""Plays the studies behind docs/results.md and writes its tables: `python docs/play_tables.py`.

From these tables follow the README's numbers and picture; `judge` gets what it ranks beside.
What is played is kept, so that a second call plays nothing, and one after an interruption the rest.
Costs are not measured here: their table is written from what `make benchmark` left, if it did.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import front_page
from play_paper import draw_figures, paper_block, paper_studies, sentences_block
from tables import ROOT, by_policy, example, rewrite, seeds_from, table

from swarm_logistics_env import spi
from swarm_logistics_env.cli.judging import ENTRIES
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.report import benchmark, drawing, section
from swarm_logistics_env.runs.engines import usable_cores
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.studies import Study
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.results import StudyResults

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = ROOT / "docs" / "results.md"
MEDIA = ROOT / "docs" / "media"
OUT = ROOT / "results" / "tables"
BENCHMARK = ROOT / "results" / "benchmark" / "benchmark.json"
# Nothing was fitted, tuned or chosen on the seeds of these tables: defaults were fitted on those
# from 0 on; recipes and medians were chosen on some from 700,000 and from 1,000,000 on.
FIRST_SEED = 20_000
PROCESSES = usable_cores()
# Studies in examples/ that are tables of the page.
EXAMPLES = (
    "clearing", "ladder", "ladder_restocked", "leans", "shipped_policies", "robust_policy",
)  # fmt: skip


def play(studies: Iterable[Study]) -> list[StudyResults]:
    """Play what is missing of each study; return what the runs say, or exit if one failed."""
    found = []
    for study in studies:
        tally = study.run(processes=PROCESSES)
        if tally.failed:
            raise SystemExit(f"{tally.failed} runs failed: {tally.error}")
        found.append(study.findings())
    return found


def policies_block(results: StudyResults) -> str:
    """Return P and the indicators of every policy."""
    cells = (cell for cell in results.cells if cell.arm.setting.kind in ("size", "parameter"))
    found = by_policy(results.policies, cells, results.verdicts, section.ratio)
    return f"{found}\n\n{seeds_from(results)}, of each training."


def robust_block(results: StudyResults) -> str:
    """Return R and FT under each failure mode, and what Holm's method makes of them."""
    rows, told = [], dict[str, list[str]]()
    for label, tests in grouped(results.verdicts, lambda one: one.compared.label).items():
        cell = results.cells_of(tests[0].compared)[tests[0].compared.changed]
        by_symbol = {test.compared.indicator: test for test in tests}
        row = [label, section.mean_p(cell)]
        for symbol in ("R", "FT"):
            test = by_symbol[symbol]
            row.append(f"{section.ratio(test)}, {section.concluded(test)}")
            told.setdefault(test.on_property.adjusted, []).append(f"{symbol} under {label}")
        rows.append(row)
    found = "; ".join(f"{words}: {section.listed(what)}" for words, what in told.items())
    head = "", "P", "R above 0?", "FT above 0?"
    return (
        f"{table(head, rows)}\n\n`{results.policies[0]}`, "
        f"{seeds_from(results, 'seeds of each')}; verdicts by Holm's method. "
        f"{found[:1].upper()}{found[1:]}."
    )


def clearing_block(results: StudyResults) -> str:
    """Return the time to clear of every policy and condition: a row a policy."""
    settings = list(dict.fromkeys(cell.arm.setting for cell in results.cells if cell.n_seeds))
    by_place = {(cell.policy, cell.arm.setting): cell for cell in results.cells}
    rows = [
        (f"`{policy}`", *(section.time_to_clear(by_place[policy, one]) for one in settings))
        for policy in results.policies
    ]
    limit = results.plan.cases[0].scenario.duration
    return (
        f"{table(('', *settings), rows)}\n\n"
        "Median time until all items are delivered [s], with its 95 % interval: less is better; N "
        f"is 25; {seeds_from(results)}; of several trainings the mean. "
        f'"x of y": so many runs were not done after {limit:g} s.'
    )


def _worlds(found: StudyResults) -> dict[str, dict[str, Cell]]:
    """Return the cells of each table of ablations, by policy."""
    titles = dict.fromkeys(one.title for one in found.plan.specification.ablations)
    cells = found.cells
    return {name: {c.arm.setting.name: c for c in cells if c.table == name} for name in titles}


def ladder_block(cleared: StudyResults, restocked: StudyResults) -> str:
    """Return a row for each rung: its time to clear and P, and what it adds to the one before."""
    times, gains, rungs = _worlds(cleared), _worlds(restocked), cleared.policies
    kinds = "time to clear [s]", "P where items come back"
    rows = []
    for rung, above in zip(rungs, ("", *rungs)):
        before = "" if rung.startswith("ppo-") else "homing" if rung == "central" else above
        row = [f"`{rung}`"]
        for name, cells in gains.items():
            told = section.mean_p(cells[rung])
            if before:
                more = t_interval(cells[rung].by_seed - cells[before].by_seed)
                told += f" (+{section.bracketed(more, 1)})".replace("+-", "-")
            row += [section.time_to_clear(times[name][rung]), told]
        rows.append(row)
    head = ["", *(f"{kind}, {name}" for name in times for kind in kinds)]
    return f"{table(head, rows)}\n\n{seeds_from(cleared)}."


def leans_block(found: StudyResults) -> str:
    """Return a row for each world: P of every policy."""
    worlds = _worlds(found)
    for fault in found.plan.specification.faults:
        ours = [c for c in found.cells if c.table == fault.title]
        worlds[fault.title] = {c.policy: c for c in ours if c.arm.setting.name in fault.modes}
    rows = [
        (name, *(_p_and_stalls(cells[one]) for one in found.policies))
        for name, cells in worlds.items()
    ]
    head = ["", *(f"`{one}`" for one in found.policies)]
    return (
        f"{table(head, rows)}\n\n"
        f"P, items delivered in 500 s by 25 robots, with 95 % intervals; {seeds_from(found)}, of "
        "each training."
    )


def _p_and_stalls(cell: Cell) -> str:
    stalled = spi.share_stalled(cell.by_seed.ravel())
    return section.mean_p(cell) + (f"; {stalled:.0%} stalled" if stalled else "")


def draw_ladder(restocked: StudyResults, path: Path) -> None:
    """Draw P of each rung with its interval, without and with a handling time."""
    worlds = list(enumerate(_worlds(restocked).items()))
    rows = [
        (rung, [drawing.Point(name, style, "", *of[rung].mean) for style, (name, of) in worlds])
        for rung in restocked.policies
    ]

    def draw(canvas: "Figure") -> None:
        drawing.forest(canvas, rows)
        (axes,) = canvas.axes
        axes.set(xlabel="P, items delivered in 500 s where items come back", xlim=(0.0, None))
        marks, names = axes.get_legend_handles_labels()
        axes.legend(marks[: len(worlds)], names[: len(worlds)], loc="upper right")

    path.write_text(drawing.images(draw, 2.9)[0], encoding="utf-8")


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
    head = "", "agent-steps per s", "us per step", "cost per agent-step"
    return (
        f"{table(head, rows)}\n\n"
        "Cost: less is better; the median over rounds of the ratio in each.\n"
        f"On {machine['processor']}, {machine['cores']} cores, Python {machine['python']}.\n"
        f"A second process takes its first step after {found['seconds']['first_step']:.1f} s."
    )


# Other people's learners, where `make interop` has trained them; each in its largest world.
LEARNERS = ("sb3-ppo-paper", "benchmarl-ippo-paper", "torchrl-ppo-small", "benchmarl-mappo-small")


def benchmark_studies(out: Path) -> tuple[Study, ...]:
    """Return the benchmark's study of each policy that clears and of the learners, in folders."""
    trained = ROOT / "results" / "interop"
    there = [one for one in LEARNERS if (trained / f"{one}@0.safetensors").exists()]
    shipped = [one.name for one in example(out, "clearing").specification.policies]
    studies = []
    for name in (*shipped, *(f"{trained / one}@all.safetensors" for one in there)):
        folder = out / "benchmark" / section.slug(Path(name).stem)
        studies.append(Study.preset(benchmark.STUDY, out=folder, policies=[name]))
    return tuple(studies)


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
    return (
        f"{table(head, rows)}\n\n{seeds_from(found[0])}, of each training. {' '.join(board.lines)}"
    )


def main() -> None:
    """Play, rewrite the page of results, then the README."""
    paper = play(paper_studies(OUT, FIRST_SEED))
    draw_figures(paper, MEDIA)
    clearing, cleared, restocked, leans, policies, robust = play(
        example(OUT, name) for name in EXAMPLES
    )
    draw_ladder(restocked, MEDIA / "ladder.svg")
    blocks = {
        "clearing": clearing_block(clearing),
        "paper": paper_block(paper),
        "sentences": sentences_block(paper),
        "ladder": ladder_block(cleared, restocked),
        "leans": leans_block(leans),
        "policies": policies_block(policies),
        "robust": robust_block(robust),
        "benchmark": benchmark_block(play(benchmark_studies(OUT))),
    }
    if BENCHMARK.exists():
        blocks["costs"] = costs_block(json.loads(BENCHMARK.read_text(encoding="utf-8")))
    rewrite(PAGE, blocks)
    front_page.main()


if __name__ == "__main__":
    main()
