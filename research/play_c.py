"""Does a study say the same if the files of C play it? `python -m research.play_c [SEEDS]`.

Plays policies and the C that is made of them on the same seeds, as examples/broken_robots.toml
does: without a fault, and with two broken robots of 25. The C in `double` plays that study's 20
seeds; the C in `float`, which plays other runs, SEEDS of them, 80 if not told. It writes into
docs/c.md of each condition P of both, how many runs are the same to the bit or else the test of
equivalence of P within 5 %, and the word on R of both. What is played stays in results/c, and the
same command goes on after an interruption. Then it plays 160 other seeds without a fault, which
were declared after 80 seeds had left two of four such P open by less than a percent; these are not
stored. All take about an hour of a core.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from research.play_bodies import cells_of, verdicts_of
from research.search_again import delivered
from research.tables import ROOT, play, rewrite, seeds_from, table
from swarm_logistics_env import policies, spi
from swarm_logistics_env.robots.c_export import write_c
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.world.scenario import Scenario

OUT = ROOT / "results" / "c"
PAGE = ROOT / "docs" / "c.md"
NAMES = ("swarm-dt", "homing", "homing-stock", "ppo-robust")
SCENARIO = Scenario.preset("realistic").replace(restock=True)
MARGIN = 0.05
N_SEEDS_IN_DOUBLE = 20  # as in examples/broken_robots.toml
OTHER_SEEDS = range(21_000, 21_160)


def study_of(names: dict[str, str], label: str, n_seeds: int) -> Study:
    """Return the study of policies by their labels; both studies have the same labels."""
    return Study(
        name=f"played-{label}",
        policies=[{"name": name, "label": of} for of, name in names.items()],
        seeds=n_seeds,
        first_seed=20_000,
        indicators=["R"],
        scenario=SCENARIO,
        faults=[{"modes": ["FM1", "FM4", "FM4_jam"], "robots": [2]}],
        out=OUT / label,
    )


def rows_in_double(in_python: StudyResults, in_c: StudyResults) -> Iterator[tuple[str, ...]]:
    """Yield P and R of both and how many runs are the same, of each policy and condition."""
    cells = cells_of(in_c)
    verdicts = [verdicts_of(results) for results in (in_python, in_c)]
    for (policy, condition), cell in cells_of(in_python).items():
        other = cells[policy, condition]
        pairs = list(zip(cell.outcomes, other.outcomes, strict=True))
        n_equal = sum(outcome.digest == of_c.digest for outcome, of_c in pairs)
        p = (section.mean_p(cell), section.mean_p(other))
        words = (
            f"{section.ratio(of[policy, condition])}, {of[policy, condition].conclusion}"
            if (policy, condition) in of
            else ""
            for of in verdicts
        )
        yield policy, condition, *p, *words, f"{n_equal} of {len(pairs)}"


def rows_of(in_python: StudyResults, in_c: StudyResults) -> Iterator[tuple[str, ...]]:
    """Yield what both say of each policy and condition."""
    cells = cells_of(in_c)
    verdicts = verdicts_of(in_c)
    for (policy, condition), cell in cells_of(in_python).items():
        other = cells[policy, condition]
        equivalence = spi.equivalence(cell.by_seed, other.by_seed, margin=MARGIN)
        p = (section.mean_p(cell), section.mean_p(other))
        yield policy, f"P, {condition}", *p, _change(equivalence), equivalence.verdict
    for key, verdict in verdicts_of(in_python).items():
        both = (verdict, verdicts[key])
        words = " and ".join(sorted({str(word.conclusion) for word in both}))
        yield key[0], f"R, {key[1]}", *map(section.ratio, both), "", words


def _block_in_double(in_python: StudyResults, in_c: StudyResults) -> str:
    heading = ("policy", "condition", "P in Python", "P in C", "R in Python", "R in C", "same runs")
    line = f"{seeds_from(in_c)}; `realistic` with `restock`, 25 robots, 60 items; `-DSWARM_DOUBLE`."
    return table(heading, rows_in_double(in_python, in_c), line)


def in_double(source: Path) -> Path:
    """Write a file of C that is another one in `double`, beside it."""
    path = source.with_name(f"{source.stem}-double.c")
    path.write_text(f'#define SWARM_DOUBLE\n#include "{source.name}"\n', encoding="utf-8")
    return path


def rows_on_other_seeds(sources: dict[str, Path]) -> Iterator[tuple[str, ...]]:
    """Yield P of each policy and of its file on `OTHER_SEEDS`, and whether both are within 5 %."""
    with ProcessPoolExecutor(usable_cores()) as processes:
        for name, source in sources.items():
            in_python, in_c = (
                np.array(
                    list(processes.map(partial(delivered, policy, {}, SCENARIO), OTHER_SEEDS)),
                    float,
                )
                for policy in (name, f"c:{source}")
            )
            equivalence = spi.equivalence(in_python, in_c, margin=MARGIN)
            means = [spi.mean_interval(p, CONFIDENCE) for p in (in_python, in_c)]
            p = (section.bracketed(mean, 1) for mean in means)
            yield name, *p, _change(equivalence), equivalence.verdict


def _change(equivalence: spi.Equivalence) -> str:
    change = equivalence.change
    return section.bracketed(Interval(change.value, change.low, change.high), 3)


def main() -> None:
    """Write the files of C, play what is missing, and print the table."""
    n_seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 80
    OUT.mkdir(parents=True, exist_ok=True)
    files = {name: write_c(policies.load(name), SCENARIO, OUT / f"{name}.c") for name in NAMES}
    sources = {name: written.source for name, written in files.items()}
    python_names = dict(zip(NAMES, NAMES, strict=True))
    double_names = {name: f"c:{in_double(source)}" for name, source in sources.items()}
    in_python, in_c = play(
        study_of(names, label, N_SEEDS_IN_DOUBLE)
        for label, names in (("python", python_names), ("double", double_names))
    )
    rewrite(PAGE, {"in double": _block_in_double(in_python, in_c)})
    float_names = {name: f"c:{source}" for name, source in sources.items()}
    in_python, in_c = play(
        study_of(names, label, n_seeds)
        for label, names in (("python", python_names), ("c", float_names))
    )
    heading = ("policy", "condition", "in Python", "in C", "change of P", "within 5 %, or the word")
    line = f"{n_seeds} seeds from 20,000 on; `realistic` with `restock`, 25 robots, 60 items."
    other_heading = (heading[0], *heading[2:])
    other_line = f"{len(OTHER_SEEDS)} seeds from {OTHER_SEEDS[0]:,} on, without a fault."
    blocks = {
        "closed loop": table(heading, rows_of(in_python, in_c), line),
        "closed loop, other seeds": table(other_heading, rows_on_other_seeds(sources), other_line),
    }
    rewrite(PAGE, blocks)


if __name__ == "__main__":
    main()
