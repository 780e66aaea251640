"""MPE2's simple_spread as a task: P is how many landmarks are covered, summed over the steps.

Lowe et al., Multi-Agent Actor-Critic for Mixed Cooperative-Competitive Environments, NeurIPS 2017.
`pip install mpe2` brings it. Its own reward is minus a distance, which has
no positive mean, so that no ratio of it means anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpe2._mpe_utils.simple_env import SimpleEnv
from mpe2.simple_spread.simple_spread import Scenario
from numpy.typing import NDArray
from pettingzoo.utils.conversions import aec_to_parallel

from swarm_logistics_env.study.tasks import ParallelTask
from swarm_logistics_env.study.tasks.parallel_wrappers import Env

STAY, LEFT, RIGHT, DOWN, UP = range(5)
# A robot steers by where it will be after a while, or it would shoot past the landmark.
FORESIGHT = 0.4  # s
NEAR_ENOUGH = 0.05  # half the distance at which a landmark counts as covered


class FixedLandmarks(Scenario):  # type: ignore[misc]  # MPE2 is not typed
    """The scenario with a number of landmarks of its own, in which robots may be absent.

    Args:
        landmarks: how many.
        absent: numbers of the robots that are not there; the others start where they would.
    """

    def __init__(self, landmarks: int, absent: Sequence[int]) -> None:
        super().__init__()
        self._landmarks, self._absent = landmarks, set(absent)

    def make_world(self, N: int = 3) -> Any:
        """Return the world of N robots, absent ones left out."""
        world = super().make_world(max(N, self._landmarks))
        self._n_robots = N
        world.landmarks = world.landmarks[: self._landmarks]
        world.agents = [
            agent for row, agent in enumerate(world.agents[:N]) if row not in self._absent
        ]
        return world

    def reset_world(self, world: Any, np_random: np.random.Generator) -> None:
        """Place the landmarks and the robots; where one starts does not depend on how many are."""
        # Drawn before anything whose number of draws depends on the robots that are there.
        landmark_positions = np_random.uniform(-1, 1, (self._landmarks, world.dim_p))
        robot_positions = np_random.uniform(-1, 1, (self._n_robots, world.dim_p))
        super().reset_world(world, np_random)
        for position, landmark in zip(landmark_positions, world.landmarks):
            landmark.state.p_pos = position
        present = np.delete(robot_positions, list(self._absent), axis=0)
        for position, agent in zip(present, world.agents):
            agent.state.p_pos = position


def make_env(n_robots: int, landmarks: int, absent: Sequence[int] = ()) -> Env:
    """Return the environment, without an end of its own."""
    scenario = FixedLandmarks(landmarks, absent)
    world = scenario.make_world(n_robots)
    return aec_to_parallel(SimpleEnv(scenario, world, max_cycles=2**31, local_ratio=0.5))


class NearestLandmark:
    """Sends each robot to the nearest landmark to which no other robot is nearer, if there is one.

    A robot decides from its own observation, which tells where all landmarks and robots are.
    """

    def configure(self, env: Env, agents: Sequence[str | None]) -> None:
        """Learn how many landmarks and robots there are."""
        self._landmarks = len(env.unwrapped.world.landmarks)
        self._n_neighbours = len(env.possible_agents) - 1

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return an action for each row."""
        return np.array([self._action(row) for row in observations])

    def _action(self, row: NDArray[np.float32]) -> int:
        if not row.any():  # absent, or blind
            return STAY
        velocity = row[:2]
        positions = row[4:].reshape(-1, 2)
        landmarks = positions[: self._landmarks]
        neighbours = positions[self._landmarks : self._landmarks + self._n_neighbours]
        distances = np.linalg.norm(landmarks, axis=1)
        between = np.linalg.norm(landmarks[:, None] - neighbours[None], axis=2)
        is_free = distances <= between.min(1, initial=np.inf)
        goal = np.zeros(2)
        if is_free.any():
            goal = landmarks[np.argmin(np.where(is_free, distances, np.inf))]
        error = goal - FORESIGHT * velocity
        axis = int(np.argmax(np.abs(error)))
        if abs(error[axis]) < NEAR_ENOUGH:
            return STAY
        back, forth = ((LEFT, RIGHT), (DOWN, UP))[axis]
        return forth if error[axis] > 0 else back


def covered(env: Any, rewards: Any, infos: Any) -> float:
    """The number of landmarks with a robot within 0.1, summed over the steps."""
    world = env.unwrapped.world
    robots = np.array([agent.state.p_pos for agent in world.agents])
    landmarks = np.array([landmark.state.p_pos for landmark in world.landmarks])
    distances = np.linalg.norm(landmarks[:, None] - robots[None], axis=2)
    return float((distances.min(axis=1) < Scenario.CAPTURE_RADIUS).sum())


SPREAD = ParallelTask(
    make_env,
    name="simple-spread",
    n_robots=4,
    steps=50,
    parameters={"landmarks": 4},
    performance=covered,
    failures={"silent": STAY, "frozen": None, "blind": None, "noisy": 0.2, "removed": "absent"},
    policies={"nearest-landmark": NearestLandmark},
)
