"""How much of the way from a script to central control is knowing where the requested item lies?

    python -m research.play_knowing

It writes a block of docs/research/questions_of_the_field.md. What is played is kept, as by
`play_tables`. A policy's share of the way is (P - P of who is told nothing) / (P of central control
- P of who is told nothing), with a BCa interval (Efron 1987) over paired seeds.
"""

import numpy as np
from scipy.stats import bootstrap

from research.play_tables import OUT
from research.tables import ROOT, example, play, rewrite, seeds_from, table
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.verdicts.results import StudyResults

PAGE = ROOT / "docs" / "research" / "questions_of_the_field.md"
NOTHING_TOLD, CENTRAL = "told nothing", "central control"  # labels of the study


def share_of_way(p: Numbers, least: Numbers, most: Numbers) -> Interval:
    """Return how much of the way from `least` to `most` P is, with its 95 % interval.

    Args:
        p, least, most: P of a policy, of the lowest and of the highest, over the same seeds (n,).
    """

    def share(p: Numbers, least: Numbers, most: Numbers, axis: int = -1) -> Numbers:
        way = most.mean(axis=axis) - least.mean(axis=axis)
        return np.asarray((p.mean(axis=axis) - least.mean(axis=axis)) / way)

    rng = generator(1, "share of way")
    samples = bootstrap((p, least, most), share, paired=True, n_resamples=4_000, random_state=rng)
    interval = samples.confidence_interval
    return Interval(float(share(p, least, most)), float(interval.low), float(interval.high))


def rungs(results: StudyResults) -> str:
    """Return the table: P, items more than who is told nothing, and the share of the way."""
    by_label = {cell.arm.setting.name: cell for cell in results.cells}
    labels = [policy.title for policy in results.plan.specification.policies]
    cells = {label: by_label[label] for label in labels}
    least = cells[NOTHING_TOLD].by_seed
    most = cells[CENTRAL].by_seed
    rows = []
    for label, cell in cells.items():
        more = ""
        share = ""
        if label != NOTHING_TOLD:
            more = section.bracketed(t_interval(cell.by_seed - least), 1)
        if label not in (NOTHING_TOLD, CENTRAL):
            share = section.bracketed(share_of_way(cell.by_seed, least, most), 2)
        rows.append((label, section.mean_p(cell), more, share))
    heading = ("who knows where the requested item lies", "P", "items more", "share of the way")
    return table(heading, rows, f"{seeds_from(results)}; 95 % intervals.")


def main() -> None:
    """Play the study, and rewrite its table."""
    (results,) = play([example(OUT, "knowing")])
    rewrite(PAGE, {"knowing": rungs(results)})


if __name__ == "__main__":
    main()
