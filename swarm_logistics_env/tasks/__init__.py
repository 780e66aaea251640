"""Tasks: what a study can play."""

from __future__ import annotations

from swarm_logistics_env.policies.files import StableBaselinesModel

from .failing_robots import FailingRobots, RobotFault
from .parallel_policies import RandomActions, SumOfInfos, SumOfRewards
from .parallel_task import ParallelTask
from .task import Case, Outcome, Run, Task

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
]
