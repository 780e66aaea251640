"""Does a study say the same if the files of C play it? `python -m research.play_c [SEEDS]`.

Plays policies and the C that is made of them on the same seeds, as examples/broken_robots.toml
does: without a fault, and with two broken robots of 25. It writes into docs/c.md of each condition
P of both, the test of equivalence of P within 5 %, and the word on R of both. What is played stays
in results/c, and the same command goes on after an interruption. 20 seeds take about 20 minutes of
a core.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from research.play_bodies import cells_of, verdicts_of
from research.tables import ROOT, play, rewrite, table
from swarm_logistics_env import policies, spi
from swarm_logistics_env.robots.c_export import write_c
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.world.scenario import Scenario

OUT = ROOT / "results" / "c"
PAGE = ROOT / "docs" / "c.md"
NAMES = ("swarm-dt", "homing", "homing-stock", "ppo-robust")
SCENARIO = Scenario.preset("realistic").replace(restock=True)
MARGIN = 0.05


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


def rows_of(in_python: StudyResults, in_c: StudyResults) -> Iterator[tuple[str, ...]]:
    """Yield what both say of each policy and condition."""
    cells = cells_of(in_c)
    verdicts = verdicts_of(in_c)
    for (policy, condition), cell in cells_of(in_python).items():
        other = cells[policy, condition]
        equivalence = spi.equivalence(cell.by_seed, other.by_seed, margin=MARGIN)
        change = equivalence.change
        interval = section.bracketed(Interval(change.value, change.low, change.high), 3)
        p = (section.mean_p(cell), section.mean_p(other))
        yield policy, f"P, {condition}", *p, interval, equivalence.verdict
    for key, verdict in verdicts_of(in_python).items():
        both = (verdict, verdicts[key])
        words = " and ".join(sorted({str(word.conclusion) for word in both}))
        yield key[0], f"R, {key[1]}", *map(section.ratio, both), "", words


def main() -> None:
    """Write the files of C, play what is missing, and print the table."""
    n_seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    OUT.mkdir(parents=True, exist_ok=True)
    files = {name: write_c(policies.load(name), SCENARIO, OUT / f"{name}.c") for name in NAMES}
    sources = {name: written.source for name, written in files.items()}
    in_python, in_c = play(
        study_of(names, label, n_seeds)
        for label, names in (
            ("python", dict(zip(NAMES, NAMES, strict=True))),
            ("c", {name: f"c:{source}" for name, source in sources.items()}),
        )
    )
    heading = ("policy", "condition", "in Python", "in C", "change of P", "within 5 %, or the word")
    line = f"{n_seeds} seeds from 20,000 on; `realistic` with `restock`, 25 robots, 60 items."
    rewrite(PAGE, {"closed loop": table(heading, rows_of(in_python, in_c), line)})


if __name__ == "__main__":
    main()
