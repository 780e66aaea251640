"""Tasks: what a study can play."""

from __future__ import annotations

from swarm_logistics_env.tasks.failing_robots import FailingRobots, RobotFault
from swarm_logistics_env.tasks.parallel_policies import RandomActions, StableBaselinesModel
from swarm_logistics_env.tasks.parallel_task import ParallelTask
from swarm_logistics_env.tasks.performance import SumOfInfos, SumOfRewards
from swarm_logistics_env.tasks.task import Outcome, Task
from swarm_logistics_env.tasks.tuple_env import TupleEnv

__all__ = [
    "FailingRobots",
    "Outcome",
    "ParallelTask",
    "RandomActions",
    "RobotFault",
    "StableBaselinesModel",
    "SumOfInfos",
    "SumOfRewards",
    "Task",
    "TupleEnv",
]
