"""Robots whose poses were recorded, e.g. by cameras: the world adds items and sensing.

    swarm-logistics run --set n_robots=2 --bodies examples/recorded_bodies.py:Recorded

The file `poses.csv` in the current folder, or the one in the environment variable POSES, has the
columns time [s], robot, x, y [m] and heading [rad], a row for each robot and time. Robots follow
the recording, whatever the policy wants. One whose recording ends is lost.
"""

import csv
import os
from collections import defaultdict
from pathlib import Path

import numpy as np

from swarm_logistics_env.world.bodies import Orders, Placement, Poses


class Recorded:
    """Bodies that follow a recording."""

    def __init__(self) -> None:
        rows = defaultdict(list)
        path = Path(os.environ.get("POSES", "poses.csv"))
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                pose = [float(row[name]) for name in ("time", "x", "y", "heading")]
                rows[int(row["robot"])].append(pose)
        self._recordings = {robot: np.array(sorted(poses)) for robot, poses in rows.items()}

    def place(self, placement: Placement) -> None:
        """Begin at the start of the recording."""
        missing = set(range(len(placement.position))) - self._recordings.keys()
        if missing:
            raise ValueError(f"no poses of robots {sorted(missing)}: should have rows of them")
        self._period = placement.scenario.control_period
        self._step = 0
        self._poses, _ = self._read()

    def move(self, orders: Orders) -> Poses:
        """Return where the robots were one period later."""
        self._step += 1
        before = self._poses
        self._poses, lost = self._read()
        velocity = (self._poses[:, :2] - before[:, :2]) / self._period
        return Poses(self._poses[:, :2], self._poses[:, 2], velocity, lost)

    def _read(self) -> tuple[np.ndarray, np.ndarray]:
        """Return x, y and heading of each robot now, and whether its recording has ended."""
        time = self._step * self._period
        recordings = [self._recordings[robot] for robot in sorted(self._recordings)]
        poses = [
            [np.interp(time, poses[:, 0], poses[:, column]) for column in (1, 2)]
            + [np.interp(time, poses[:, 0], np.unwrap(poses[:, 3]))]
            for poses in recordings
        ]
        return np.array(poses), np.array([time > poses[-1, 0] for poses in recordings])
