"""Judge a policy of your own beside Swarm D-T: is it scalable, and robust to FM4?"""

from __future__ import annotations

import numpy as np

from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.study import Study
from swarm_logistics_env.world.observations import unflatten


class Straight:
    """Drives straight until something is near; lifts the requested item only."""

    def configure(self, scenario):
        self.scenario = scenario

    def reset(self, n_robots, seed):
        # Each robot has a stream of its own, so that another swarm size changes no robot's draws.
        self.rngs = [generator(seed, "straight", robot) for robot in range(n_robots)]
        self.heading = np.array([rng.uniform(-np.pi, np.pi) for rng in self.rngs])

    def act(self, observations):
        row = unflatten(observations, self.scenario)
        carries = row["carrying_requested"][:, 0] > 0
        ranges = np.minimum(row["range_walls"], row["range_robots"])
        ranges = np.where(carries[:, None], np.minimum(ranges, row["range_items"]), ranges)
        for robot in np.flatnonzero(ranges.min(axis=1) < 0.3):
            away = ranges[robot].argmin() * np.pi / 8 + np.pi  # beam k looks k * 22.5 degrees left
            self.heading[robot] = away + self.rngs[robot].uniform(-1.0, 1.0)
        commands = np.zeros((len(observations), 4))
        commands[:, 0] = np.cos(self.heading)  # forward
        commands[:, 1] = np.sin(self.heading)  # left
        holds = row["item_requested"].any(axis=1) | carries
        commands[:, 3] = np.where(holds, 1.0, -1.0)  # gripper: hold, open
        return commands


def main(seeds=10, duration=300.0, out="results/straight"):
    study = Study(
        name="straight",
        policies=[Straight(), "swarm-dt"],
        seeds=seeds,
        scenario={"duration": duration, "restock": True},
        sizes=[{"values": [10, 25]}],
        faults=[{"modes": ["FM4"], "robots": [2]}],
        out=out,
    )
    study.run()  # what is there already is kept: the same call goes on after an interruption
    table = study.indicators()
    print(table[["policy", "indicator", "value", "low", "high", "verdict"]].round(2).to_string())
    print("\n".join(str(path) for path in study.report()))
    return table


if __name__ == "__main__":
    main()
