"""A robot's memory, and its observations and commands in the frame of its own motion."""

from swarm_logistics_env.motion.frame import INPUTS, OUTPUTS, MotionView

__all__ = ["INPUTS", "OUTPUTS", "MotionView"]
