"""The pymunk floor: the fastest pymunk script that moves the same bodies the same way.

Same robots, pivot joints, walls and items, same substeps, one batch write and one batch read per
control step, 4 iterations, slop 0.001, one buffer reused per direction; no sensing, no logistics.
"""

from __future__ import annotations

import numpy as np
import pymunk
from pymunk import batch

from benchmarks.recording import Recording


class Floor:
    """A space that replays the wanted velocities of a recording."""

    def __init__(self, recording: Recording) -> None:
        scenario = recording.scenario
        n = scenario.n_robots
        self._wanted = np.ascontiguousarray(recording.wanted_velocity)
        self._substeps, self._period = scenario.n_substeps, scenario.physics_period
        self._space = space = pymunk.Space()
        space.iterations, space.collision_slop = 4, 0.001
        width, height = scenario.warehouse_width, scenario.warehouse_height
        corners = [(-0.5, -0.5), (width + 0.5, -0.5), (width + 0.5, height + 0.5)]
        corners.append((-0.5, height + 0.5))
        for side in range(4):
            space.add(pymunk.Segment(space.static_body, corners[side - 1], corners[side], 0.5))
        unladen = pymunk.ShapeFilter(categories=1, mask=1 | 2)
        for x, y in recording.items.tolist():
            item = pymunk.Circle(space.static_body, scenario.item_radius, (x, y))
            item.filter = pymunk.ShapeFilter(categories=4)
            space.add(item)
        robots, controls = [], []
        for x, y in recording.start.tolist():
            robot = pymunk.Body(scenario.robot_mass, float("inf"))
            robot.position = (x, y)
            shape = pymunk.Circle(robot, scenario.robot_radius)
            shape.filter = unladen
            robots.append((robot, shape))
            controls.append(pymunk.Body(body_type=pymunk.Body.KINEMATIC))
        space.add(*(robot for robot, _ in robots), *controls)
        for (robot, shape), control in zip(robots, controls, strict=True):
            joint = pymunk.PivotJoint(robot, control, (0.0, 0.0), (0.0, 0.0))
            joint.max_bias = 0.0
            joint.max_force = scenario.robot_mass * scenario.max_acceleration
            space.add(shape, joint)
        # The static body is read too, and pymunk wants one number to spare.
        self._read, self._written = np.zeros((2 * n + 1) * 4 + 1), np.zeros((2 * n + 1) * 2 + 1)
        self._state = self._read[:-1].reshape(-1, 4)
        self._velocity = self._written[:-1].reshape(-1, 2)
        self._reader, self._writer = batch.Buffer(), batch.Buffer()
        self._reader.set_float_buf(self._read)
        self._writer.set_float_buf(self._written)
        self._n = n

    def step(self, index: int) -> None:
        """Take control step `index` of the recording."""
        n, space = self._n, self._space
        self._velocity[:n] = self._state[:n, 2:4]
        self._velocity[n : 2 * n] = self._wanted[index]
        batch.set_space_bodies(space, batch.BodyFields.VELOCITY, self._writer)
        for _ in range(self._substeps):
            space.step(self._period)
        self._reader.clear()
        batch.get_space_bodies(
            space, batch.BodyFields.POSITION | batch.BodyFields.VELOCITY, self._reader
        )
