"""Wrappers: break an environment, resize it, change it while it runs, reward by indicators, and
let it be read in the frame of its robots' motion.

Each is an environment itself, so they stack in any order; only `FixedAgents` has to be the
outermost. The seed of an episode decides what a wrapper draws for it. If several ask for the same
thing, the options of the reset win, then the outer wrapper, then the inner one; faults add up.
"""

from .condition import Condition
from .discrete_actions import DiscreteActions
from .fault_injection import FaultInjection
from .fixed_agents import FixedAgents
from .indicator_reward import IndicatorReward
from .motion_frame import MotionFrame
from .parameter_change import ParameterChange
from .reference_performances import RunningMeans
from .swarm_size import SwarmSize
from .wrapper import Wrapper

__all__ = [
    "Condition",
    "DiscreteActions",
    "FaultInjection",
    "FixedAgents",
    "IndicatorReward",
    "MotionFrame",
    "ParameterChange",
    "RunningMeans",
    "SwarmSize",
    "Wrapper",
]
