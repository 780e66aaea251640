"""Which of several trainings is the median one: `python docs/play_medians.py FILE ...`.

Declared before the trainings: each is played in all conditions of the development tables of the
benchmark, over 4 seeds of its own; the one whose P, averaged over these conditions, is the median
(of an even number the lower one of the two) is shipped under the recipe's name.
"""

import sys
from pathlib import Path

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env.policies import read_card
from swarm_logistics_env.questions.presets import load_preset
from swarm_logistics_env.studies import Study
from swarm_logistics_env.verdicts.cell import Cell


def means(files: list[str]) -> dict[str, float]:
    """Return P of each policy, averaged over the development conditions."""
    benchmark = load_preset("benchmark")
    tables = {
        kind: [part for part in getattr(benchmark, kind) if part.title.startswith("Development")]
        for kind in ("faults", "parameters")
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
    cells = {(cell.policy, cell.arm.case.key): cell for cell in study.findings().cells}
    by_policy: dict[str, list[Cell]] = map_reduce(cells.values(), lambda cell: cell.policy)
    return {file: float(np.mean([cell.mean.value for cell in by_policy[file]])) for file in files}


if __name__ == "__main__":
    mean_of_file = means(sys.argv[1:])
    ascending = sorted(mean_of_file, key=mean_of_file.__getitem__)
    for file in ascending:
        seed = read_card(Path(file)).seed
        print(f"{file}: training seed {seed}, mean P {mean_of_file[file]:.1f}")
    print(f"Median: {ascending[(len(ascending) - 1) // 2]}")
