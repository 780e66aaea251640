"""Tasks: what a study can play."""

from swarm_logistics_env.policies.sb3_files import StableBaselinesModel

from .outcome import Outcome
from .parallel_policies import RandomActions, SumOfInfos, SumOfRewards
from .parallel_task import ParallelTask
from .parallel_wrappers import ChangingAgents, FailingRobots, PaddedAgents, RobotFault
from .task import Case, Run, Task
from .task_world import TaskWorld

__all__ = [
    "Case",
    "ChangingAgents",
    "FailingRobots",
    "Outcome",
    "PaddedAgents",
    "ParallelTask",
    "RandomActions",
    "RobotFault",
    "Run",
    "StableBaselinesModel",
    "SumOfInfos",
    "SumOfRewards",
    "Task",
    "TaskWorld",
]
