"""Which of several trainings is the median one: `python -m research.play_medians FILE ...`.

Declared before the trainings: each is played in the development half of the benchmark, over 4 seeds
of its own. In each cell P is set beside the mean of all trainings, so that no rich cell rules; the
training whose mean of these shares is the median (of an even number the lower one of the two) is
shipped under the recipe's name. The networks that are shipped now were chosen so in the development
conditions of the second edition.
"""

import sys
from pathlib import Path

import numpy as np

from swarm_logistics_env.policies import read_card
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.benchmark_cells import BASE, development_cells
from swarm_logistics_env.study.report.benchmark import share


def shares(files: list[str]) -> dict[str, float]:
    """Return the share of each policy, averaged over the development cells."""
    study = Study(
        name="medians",
        policies=[{"name": file, "label": file} for file in files],
        seeds=4,
        first_seed=700_000,
        scenario=BASE,
        ablations=development_cells(),
        out=Path("results", "medians", "-".join(Path(file).stem for file in files)),
    )
    study.run(processes=2)
    p_of = {(cell.arm.setting.name, cell.table): cell.mean.value for cell in study.findings().cells}
    titles = [part.title for part in study.specification.ablations]
    p = np.array([[p_of[file, title] for title in titles] for file in files])
    return dict(zip(files, share(p, p.mean(axis=0)).mean(axis=1).tolist()))


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
