"""The indicators of published swarms: `python -m research.play_published NAME=PATH ...`.

Judges the results that others published, each a file or folder that is read unedited, and writes
the tables of docs/published.md. NAME is one of `SETS`; sets that are not given keep their rows.
`controllers=PATH`, with a clone of `SOURCES["simulator"]`, plays published controllers: in the
world of that simulator, beside the times in the clone, and in this package's (five minutes).
"""

from __future__ import annotations

import ast
import json
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from more_itertools import map_reduce

from research.tables import ROOT, example, play, rewrite, table
from swarm_logistics_env import Scenario, judge, run_episode, spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.report.section import (
    NOTHING,
    bracketed,
    fixed,
    mean_p,
    ratio,
    share_in_words,
)
from swarm_logistics_env.study.report.tables import contacts_text, critical_size_in_words
from swarm_logistics_env.study.verdicts.collapses import collapses, edges
from swarm_logistics_env.study.verdicts.results import StudyResults

PAGE = ROOT / "docs" / "published.md"
ROWS = ROOT / "docs" / "results" / "published.json"


class PublishedSet(NamedTuple):
    """Results that somebody published.

    Attributes:
        source: repository and folder.
        licence: of the results.
        options: of `judge`, as arguments of `read_trials`.
        command: the same on the command line.
    """

    source: str
    licence: str
    options: Mapping[str, Any] = MappingProxyType({})
    command: str = "judge PATH"


_POGEMA = "CognitiveAISystems/pogema-benchmark, raw_data_LMAPF"
_MILNER = {"columns": {"work": "boxes", "seed": "boxes"}}
SETS = {
    "pogema-warehouse": PublishedSet(f"{_POGEMA}/03-warehouse", "Apache 2.0"),
    "pogema-cities": PublishedSet(f"{_POGEMA}/04-movingai", "Apache 2.0"),
    "milner-times": PublishedSet(
        "emmilner/swarm_sim, steps until all boxes are delivered",
        "none seen",
        _MILNER,
        "judge PATH --column work=boxes --column seed=boxes",
    ),
    "milner-rates": PublishedSet("emmilner/swarm_sim, boxes in 1,000 steps", "none seen"),
    "foraging-faults": PublishedSet("MARSLab-UTRGV/RL-FL-Foraging, results/exp4b", "none seen"),
    "foraging-sizes": PublishedSet("MARSLab-UTRGV/RL-FL-Foraging, 4 to 16 robots", "none seen"),
}

# The simulator's world: a step of 0.02 m is 0.01 s at 2 m/s, and robots have no inertia. A box is
# delivered once its centre is a radius before the area, which is a fifth of the width.
SIMULATOR = Scenario(
    warehouse_width=5.0,
    warehouse_height=5.0,
    delivery_width=1.125,
    duration=1000.0,
    max_acceleration=1e4,
    heading_drift=0.0,
    control_period=0.01,
    physics_period=0.01,
)
CONTROLLERS = "controllers"
FIRST_SEED = 640_000  # nothing else uses these
N_RUNS = 10  # as many as the published means are over


class Walk(NamedTuple):
    """A task of the simulator, and who plays it here.

    Attributes:
        task: its name in the other tables.
        file: of the published times: text of a dict {robots: {boxes: steps}}.
        policy: a name, and parameters if it has any.
        in_sequence: whether one box is asked for at a time; else all are at once.
    """

    task: str
    file: str
    policy: PolicySpec
    in_sequence: bool = False


_WITHOUT_BIAS = PolicySpec(name="biased-walk", parameters={"bias": 0.0})
_COMPASS = PolicySpec(name="biased-walk-compass")
WALKS = (
    Walk("task1", "task_1_new.txt", _WITHOUT_BIAS),
    Walk("task1-bias", "task_1_w_bias_new.txt", _COMPASS),
    Walk("task1-bias", "task_1_w_bias_new.txt", PolicySpec(name="biased-walk")),
    Walk("task2-bias", "task_2_w_bias_new.txt", _COMPASS, in_sequence=True),
)
BOXES = (10, 30)


def time_rows(
    clone: Path, sizes: Sequence[int] = (10, 30, 50), n_runs: int = N_RUNS
) -> Iterator[list[str]]:
    """Yield a row for each walk and size: published and measured steps until all is delivered."""
    for walk in WALKS:
        published = ast.literal_eval((clone / walk.file).read_text(encoding="utf-8"))
        for n_robots in sizes:
            cells = []
            shares = []
            for n_boxes in BOXES:
                scenario = SIMULATOR.replace(
                    n_robots=n_robots,
                    n_items=n_boxes,
                    n_requests=1 if walk.in_sequence else n_boxes,
                )
                steps = played_steps(scenario, walk.policy, n_runs)
                cells += [f"{published[n_robots][n_boxes]:,.0f}", in_thousands(steps)]
                shares.append(steps.value / published[n_robots][n_boxes])
            yield [
                walk.task,
                f"`{walk.policy.title}`",
                str(n_robots),
                *cells,
                fixed(float(np.sqrt(np.prod(shares))), 2),
            ]


def played_steps(scenario: Scenario, policy: PolicySpec, n_runs: int) -> spi.Interval:
    """Return the mean number of control steps until all items are delivered."""
    ends = [
        run_episode(scenario, policy.load(), seed).ended_at
        for seed in range(FIRST_SEED, FIRST_SEED + n_runs)
    ]
    return spi.mean_interval(np.array(ends) / scenario.control_period)


def in_thousands(steps: spi.Interval) -> str:
    """Return a mean with its limits, with commas: "1,234 [1,001, 1,467]"."""
    if steps.low is None or steps.high is None:
        return f"{steps.value:,.0f}"
    return f"{steps.value:,.0f} [{steps.low:,.0f}, {steps.high:,.0f}]"


def realistic_rows(results: StudyResults) -> Iterator[list[str]]:
    """Yield a row for each policy of examples/published_controllers.toml."""
    r_of = {verdict.compared.policy: ratio(verdict) for verdict in results.verdicts}
    for policy, cells in map_reduce(results.cells, lambda cell: cell.policy).items():
        p_texts = [mean_p(cell) for cell in cells]
        yield [f"`{policy}`", *p_texts, r_of[policy], contacts_text(cells[0])]


def controller_rows(clone: Path) -> dict[str, Any]:
    """Play the published controllers in both worlds; return the rows of both tables."""
    times = [*time_rows(clone)]
    (results,) = play([example(ROOT / "results" / "published", "published_controllers")])
    return {"times": times, "realistic": [*realistic_rows(results)]}


def scalability_rows(results: StudyResults) -> Iterator[list[str]]:
    """Yield a row for each policy: sizes, S from each to the next, and what is told of collapse."""
    sized = [v for v in results.verdicts if v.compared.indicator == "S"]
    named = map_reduce(collapses(results.cells), lambda collapse: collapse.cell.policy)
    critical = {edge.cells[0].policy: edge for edge in edges(results.cells)}
    for policy, verdicts in map_reduce(sized, lambda verdict: verdict.compared.policy).items():
        sizes = [int(verdicts[0].compared.original.setting.value)]
        sizes += [int(verdict.after.value) for verdict in verdicts]
        assert all(before < after for before, after in pairwise(sizes))
        words = [
            f"{collapse.cell.words}: {share_in_words(collapse.share)}"
            for collapse in named.get(policy, [])
        ]
        if policy in critical:
            words.append(critical_size_in_words(critical[policy]))
        values = " ".join(NOTHING if v.value is None else fixed(v.value, 2) for v in verdicts)
        counts = Counter(verdict.on_property.adjusted for verdict in verdicts)
        verdict_words = ", ".join(f"{count} {word}" for word, count in counts.items())
        chain = " → ".join(map(str, sizes))
        yield [policy, chain, values, verdict_words, "; ".join(words) or NOTHING]


def other_rows(results: StudyResults) -> Iterator[list[str]]:
    """Yield a row for each question that is none of scalability."""
    for verdict in results.verdicts:
        comparison = verdict.compared
        if comparison.indicator != "S" and verdict.interval is not None:
            question = f"{comparison.indicator} {verdict.after}"
            value = bracketed(verdict.interval, 2)
            yield [comparison.policy, question, value, verdict.on_property.adjusted]


def judged(name: str, path: str) -> dict[str, Any]:
    """Return the rows of a set, or why it is refused."""
    try:
        results = judge(path, **SETS[name].options)
    except StudyError as error:
        return {"refused": str(error).partition(": ")[2]}
    rows = {"scalability": [*scalability_rows(results)], "others": [*other_rows(results)]}
    return {**rows, "runs": len(results.outcomes)}


def blocks(rows: Mapping[str, Any]) -> dict[str, str]:
    """Return the tables of the page, from the rows of each set."""
    sets = {name: rows[name] for name in SETS if name in rows}
    sources = [
        [name, SETS[name].source, SETS[name].licence, f"`{SETS[name].command}`", _outcome(of_set)]
        for name, of_set in sets.items()
    ]
    scaling = [[name, *row] for name in sets for row in sets[name].get("scalability", [])]
    questions = [[name, *row] for name in sets for row in sets[name].get("others", [])]
    head = ("set", "policy", "N", "S from each to the next", "S > 0", "runs that collapse")
    controllers = rows[CONTROLLERS]
    steps = [f"{n_boxes} boxes, {whose}" for n_boxes in BOXES for whose in ("published", "here")]
    times_head = ("task", "policy", "N", *steps, "here / published")
    realistic_head = ("policy", "P", "P, two in FM4", "R", "contacts a robot-minute")
    return {
        "published sources": table(("set", "source", "licence", "command", "read"), sources),
        "published s": table(head, scaling),
        "published others": table(("set", "policy", "question", "value", "> 0"), questions),
        "published times": table(times_head, controllers["times"]),
        "published realistic": table(realistic_head, controllers["realistic"]),
    }


def _outcome(of_set: Mapping[str, Any]) -> str:
    return f"refused: {of_set['refused']}" if "refused" in of_set else f"{of_set['runs']:,} runs"


def main() -> None:
    """Judge the sets that are given, and write the page's tables."""
    rows: dict[str, Any] = json.loads(ROWS.read_text(encoding="utf-8"))
    for name, _, path in (argument.partition("=") for argument in sys.argv[1:]):
        rows[name] = controller_rows(Path(path)) if name == CONTROLLERS else judged(name, path)
    ROWS.write_text(json.dumps(rows, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    rewrite(PAGE, blocks(rows))


if __name__ == "__main__":
    main()
