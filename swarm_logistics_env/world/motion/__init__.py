"""A robot's memory, and its observations and commands in the frame of its own motion."""

from swarm_logistics_env.world.motion.frame import OUTPUTS, MotionView
from swarm_logistics_env.world.motion.network_inputs import INPUTS

__all__ = ["INPUTS", "OUTPUTS", "MotionView"]
