"""Which of several trainings is the median one: `python -m research.play_medians FILE ...`.

Declared before the trainings: each is played in all conditions of the development tables of the
benchmark, over 4 seeds of its own. In each condition P is set beside the mean of all trainings, so
that no rich condition rules; the training whose mean of these shares is the median (of an even
number the lower one of the two) is shipped under the recipe's name.
"""

import sys
from pathlib import Path

import numpy as np

from swarm_logistics_env.policies import read_card
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.presets import load_preset


def shares(files: list[str]) -> dict[str, float]:
    """Return the share of each policy, averaged over the development conditions."""
    benchmark = load_preset("benchmark")
    tables = {
        kind: [part for part in getattr(benchmark, kind) if part.title.startswith("Development")]
        for kind in ("sizes", "faults", "parameters")
    }
    study = Study(
        name="medians",
        policies=[{"name": file, "label": file} for file in files],
        seeds=4,
        first_seed=700_000,
        scenario=benchmark.scenario,
        out=Path("results", "medians", "-".join(Path(file).stem for file in files)),
        **tables,
    )
    study.run(processes=2)
    p_of = {
        (cell.policy, cell.table, cell.arm.setting): cell.mean.value
        for cell in study.findings().cells
    }
    conditions = dict.fromkeys((table, setting) for _, table, setting in p_of)
    p = np.array([[p_of[file, *condition] for condition in conditions] for file in files])
    return dict(zip(files, np.mean(p / p.mean(axis=0), axis=1).tolist()))


def main(files: list[str]) -> None:
    """Print the share of each file, ascending, and which is the median."""
    share_of_file = shares(files)
    ascending = sorted(share_of_file, key=share_of_file.__getitem__)
    for file in ascending:
        seed = read_card(Path(file)).seed
        print(f"{file}: training seed {seed}, mean share {share_of_file[file]:.3f}")
    print(f"Median: {ascending[(len(ascending) - 1) // 2]}")


if __name__ == "__main__":
    main(sys.argv[1:])
