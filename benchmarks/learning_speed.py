"""Print how fast a preset learns: agent-steps per second, and when it passed scripted policies.

Needs the extra `train`. Times are of the processor, evaluations left out, and beside them stands
how many agent-steps of `swarm-dt` the same process plays in that time, so that machines can be
compared. The training goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from swarm_logistics_env import policies, run_episode
from swarm_logistics_env.train import Training, load_training
from swarm_logistics_env.train.curve import SUMMARY
from swarm_logistics_env.train.settings import Scores
from swarm_logistics_env.train.trainer import train


def scripted_rate(training: Training, episodes: int) -> float:
    """Return agent-steps per second of the processor of `swarm-dt` in the evaluation's world."""
    scenario = training.scenario.replace(n_robots=training.evaluation.n_robots)
    run_episode(scenario, policies.load("swarm-dt"), 0)  # kernels are loaded
    began = time.process_time()
    for seed in range(1, episodes + 1):
        run_episode(scenario, policies.load("swarm-dt"), seed)
    return episodes * scenario.n_steps * scenario.n_robots / (time.process_time() - began)


def speeds(summary: dict[str, Any], scripted: float) -> Table:
    """Return the table of agent-steps per second."""
    table = Table("", "agent-steps/s", "of swarm-dt's", title="Speed, one processor")
    rates = {**summary["agent_steps_per_cpu_second"], "playing swarm-dt": scripted}
    for name, rate in rates.items():
        table.add_row(name, f"{rate:,.0f}", f"{rate / scripted:.3f}")
    return table


def passes(summary: dict[str, Any], scripted: float) -> Table:
    """Return the table of when P passed that of scripted policies."""
    table = Table("P above", "P", "agent-steps", "CPU s", "agent-steps of swarm-dt in that time")
    for name, measured in summary["references"].items():
        row = summary["passed"][name]
        when = ("not passed", "", "")
        if row is not None:
            seconds = row["cpu_seconds"]
            when = (f"{row['agent_steps']:,}", f"{seconds:,.0f}", f"{seconds * scripted:,.0f}")
        table.add_row(
            f"{name} ({measured['P']:.4g})", "" if row is None else f"{row['P']:.4g}", *when
        )
    return table


def main(words: list[str] | None = None) -> None:
    """Train, and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="delivery", help="of a training, or a TOML file")
    parser.add_argument("--agent-steps", type=int, help="instead of the preset's")
    parser.add_argument("--every", type=int, default=250_000, help="agent-steps an evaluation")
    parser.add_argument("--episodes", type=int, default=4, help="of swarm-dt, for its speed")
    parser.add_argument("--out", type=Path, default=Path("results/benchmark/learning"))
    given = parser.parse_args(words)
    changes = {"agent_steps": given.agent_steps} if given.agent_steps else {}
    training = load_training(given.preset, threads=1, scores=Scores(seeds=0), **changes)
    training = training.replace(evaluation=training.evaluation.replace(every=given.every))
    train(training, given.out, device="cpu")
    summary = json.loads((given.out / SUMMARY).read_text(encoding="utf-8"))
    scripted = scripted_rate(training, given.episodes)
    console = Console()
    console.print(speeds(summary, scripted))
    console.print(passes(summary, scripted))


if __name__ == "__main__":
    main()
