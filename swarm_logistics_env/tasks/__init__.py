"""Tasks: what a study can play."""

from __future__ import annotations

from swarm_logistics_env.policies.files import StableBaselinesModel

from .failing_robots import FailingRobots, RobotFault
from .parallel_policies import RandomActions
from .parallel_task import ParallelTask
from .performance import SumOfInfos, SumOfRewards
from .task import Case, Outcome, Run, Task
from .tuple_env import TupleEnv

__all__ = [
    "Case",
    "FailingRobots",
    "Outcome",
    "ParallelTask",
    "RandomActions",
    "RobotFault",
    "Run",
    "StableBaselinesModel",
    "SumOfInfos",
    "SumOfRewards",
    "Task",
    "TupleEnv",
]
