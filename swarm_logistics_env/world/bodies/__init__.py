"""What moves the robots: another engine, another simulator, or robots in a hall."""

from .bodies import BODIES, Bodies, Orders, Placement, Poses, load_bodies

__all__ = ["BODIES", "Bodies", "Orders", "Placement", "Poses", "load_bodies"]
