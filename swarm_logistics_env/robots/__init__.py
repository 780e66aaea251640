"""Robots: policies as the programs of single robots."""

from swarm_logistics_env.robots.c_export import CFiles, write_c

__all__ = ["CFiles", "write_c"]
