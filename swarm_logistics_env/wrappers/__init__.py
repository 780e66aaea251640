"""Wrappers: break, resize or change an environment, reward by indicators, see in motion's frame.

Each is an environment itself, so they stack in any order; only `FixedAgents` has to be the
outermost. The seed of an episode decides what a wrapper draws for it. If several ask for the same
thing, the options of the reset win, then the outer wrapper, then the inner one; faults add up.
"""

from .action_forms import DiscreteActions, MotionFrame
from .disturbances import FaultInjection, ParameterChange
from .indicator_payments import RunningMeans
from .indicator_reward import IndicatorReward
from .swarm_size import FixedAgents, SwarmSize
from .wrapper import Condition, Wrapper

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
