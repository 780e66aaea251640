"""Wrappers: break an environment, resize it, change it while it runs, reward by indicators, and
let it be read in the frame of its robots' motion.

Each is an environment itself, so they stack in any order; only `FixedAgents` has to be the
outermost. The seed of an episode decides what a wrapper draws for it. If several ask for the same
thing, the options of the reset win, then the outer wrapper, then the inner one; faults add up.
"""

from swarm_logistics_env.wrappers.condition import Condition
from swarm_logistics_env.wrappers.discrete_actions import DiscreteActions
from swarm_logistics_env.wrappers.fault_injection import FaultInjection
from swarm_logistics_env.wrappers.fixed_agents import FixedAgents
from swarm_logistics_env.wrappers.indicator_reward import IndicatorReward
from swarm_logistics_env.wrappers.motion_frame import MotionFrame
from swarm_logistics_env.wrappers.parameter_change import ParameterChange
from swarm_logistics_env.wrappers.reference_performances import RunningMeans
from swarm_logistics_env.wrappers.swarm_size import SwarmSize
from swarm_logistics_env.wrappers.wrapper import Wrapper

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
