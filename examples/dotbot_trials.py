"""From study to robots to verdict: 12 DotBots run the file of C that a study played.

The robots' faults are those of the study, made by a layer between policy and motors. Each trial
becomes a row of trials.csv, which is judged beside the study. Needs a compiler of C and, for the
DotBots' simulator, pydotbot.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from swarm_logistics_env import Scenario, Warehouse, judge, policies
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.robots import FaultLayer, append_trial, write_c
from swarm_logistics_env.study import Study

FAULT = "FM2:4@20"  # of the twelve, four stop picking up after 20 s
ROBOTS = Scenario.preset("dotbots").replace(n_robots=12)


def run_trial(policy, scenario, seed, faults):
    """Return how many items a swarm delivers whose robots have a layer each."""
    layers = [FaultLayer(faults, scenario, number, seed) for number in range(scenario.n_robots)]
    world = Warehouse(scenario)
    rows = world.reset(seed)
    start(policy, scenario, seed)
    while not world.is_over_time:
        time = world.state.time
        sensed = [layer.sensed(row, time) for layer, row in zip(layers, rows, strict=True)]
        commands = policy.act(np.array(sensed))
        driven = [
            layer.driven(command, row, time)
            for layer, command, row in zip(layers, commands, sensed, strict=True)
        ]
        rows = world.step(np.array(driven))
    return world.state.delivered


def main(seeds=3, duration=120.0, bodies="dotbots", out="results/dotbots"):
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    scenario = ROBOTS.replace(duration=duration)
    controller = f"c:{write_c(policies.load('ppo-robust'), scenario, folder / 'robot.c').source}"

    study = Study(
        policies=[controller],
        seeds=seeds,
        scenario=scenario,
        faults=[{"modes": ["FM2"], "robots": [4], "onsets": [20.0]}],
        out=folder / "study",
    )
    study.run()

    trials = folder / "trials.csv"
    trials.unlink(missing_ok=True)
    in_hall = scenario.replace(bodies=bodies)
    for seed in range(seeds):
        for faults in ([], [FAULT]):
            delivered = run_trial(policies.load(controller), in_hall, seed, faults)
            append_trial(trials, faults, in_hall, seed, delivered)

    predicted = study.findings()
    judged = judge(trials)
    for title, findings in (("Study", predicted), (f"Trials, {bodies}", judged)):
        print(title)
        table = findings.cell_table[["cell", "mean", "low", "high"]]
        print(table.round(1).to_string(index=False))
        print(findings)
    return predicted, judged


if __name__ == "__main__":
    main()
