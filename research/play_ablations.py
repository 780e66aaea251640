"""What each part of the recipe `taught` brings: `python -m research.play_ablations` (3 core-hours).

Trains the recipe for a third of its decisions, and versions of it that lack a part or talk, three
times each, and measures P in the recipe's world on seeds that nothing was fitted on. Without a
teacher PPO takes as many decisions as imitation and PPO do else; without PPO imitation is all. It
writes a block of docs/training.md. What is trained stays in results/ablations, and the same command
goes on after an interruption.

Declared before the first training: a part brings something where the 95 % interval of the change
over trainings (Welch's) without it is below 0, and messages where that with them is above 0. There
is no correction for the number of versions.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from research.tables import ROOT, difference_of_means, rewrite, table, with_blocks
from swarm_logistics_env import policies, run_episode
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.summaries import interval_of_mean
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.runs.engines import usable_cores
from swarm_logistics_env.train import Training, load_training
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.world.motion.voices import N_MESSAGES

OUT = ROOT / "results" / "ablations"
PAGE = ROOT / "docs" / "training.md"
BLOCK_NAME = "ablations"
TRAININGS = range(3)
SEEDS = range(460_000, 460_024)
WHOLE = "the recipe"


def versions() -> dict[str, Training]:
    """Return the recipe for a third of its decisions, and what lacks a part of it, by title."""
    taught = load_training("taught", threads=1)
    recipe = taught.replace(agent_steps=taught.agent_steps // 3, scores={"seeds": 0})
    network, teacher = recipe.network, recipe.teacher
    assert teacher is not None
    rewards = {term: weight for term, weight in recipe.rewards.items() if term != "held_inside"}
    return {
        WHOLE: recipe,
        "no PPO, imitation alone": recipe.replace(agent_steps=1),
        "no teacher, as many decisions in all": recipe.replace(
            teacher=None, agent_steps=recipe.agent_steps + teacher.decisions
        ),
        "rows of the teacher alone": recipe.replace(teacher=teacher.replace(shares=(1.0, 1.0))),
        "no warm-up": recipe.replace(ppo=recipe.ppo.replace(warm_up=0)),
        "no pull": recipe.replace(teacher=teacher.replace(pull=0.0)),
        "three outputs, no classes": recipe.replace(
            network=network.replace(head="outputs", exploration=1.0)
        ),
        "no role": recipe.replace(network=network.replace(role=False)),
        "no pay for holding inside": recipe.replace(rewards=rewards),
        "the last network, not the best": recipe.replace(keep="last"),
        "with messages": recipe.replace(
            network=network.replace(talks=True),
            scenario=recipe.scenario.replace(message_size=N_MESSAGES),
        ),
    }


def measure(title: str, seed: int) -> float:
    """Return the mean P of a training, trained if it was not yet."""
    training = versions()[title].replace(seed=seed)
    path = train(training, OUT / f"{title.replace(' ', '-').replace(',', '')}-{seed}")
    policy = policies.load(str(path))
    scenario = training.evaluation_scenario
    return float(np.mean([run_episode(scenario, policy, run).delivered for run in SEEDS]))


def rows_of(p: Mapping[str, Numbers]) -> Iterator[tuple[str, ...]]:
    """Yield a row of each version, of its P by training."""
    for title, by_training in p.items():
        change = section.NOTHING
        if title != WHOLE:
            change = section.bracketed(difference_of_means(by_training, p[WHOLE]), 1)
        yield title, section.bracketed(interval_of_mean(by_training), 1), change


def main(processes: int) -> None:
    """Train, measure, and write the table."""
    # A page without the block is told before anything is trained.
    with_blocks(PAGE.read_text(encoding="utf-8"), {BLOCK_NAME: ""})
    titles = versions().keys()
    with ProcessPoolExecutor(processes) as pool:
        futures = {
            title: [pool.submit(measure, title, seed) for seed in TRAININGS] for title in titles
        }
        p = {
            title: np.array([future.result() for future in of_title])
            for title, of_title in futures.items()
        }
    scenario = versions()[WHOLE].evaluation_scenario
    line = (
        f"{scenario.n_robots} robots, {len(TRAININGS)} trainings each, {len(SEEDS)} seeds from "
        f"{SEEDS[0]:,} on; 95 % intervals over trainings, of changes by Welch's test."
    )
    rewrite(PAGE, {BLOCK_NAME: table(("version", "P", "change"), rows_of(p), line)})


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else usable_cores())
