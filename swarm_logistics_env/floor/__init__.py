"""Floors: plans of warehouses with racks, walls and docks, and ways in them."""

from .floor_plan import (
    PLAN_SIZES,
    FloorPlan,
    floor_plan,
    floor_title,
    plan_names,
    plan_text,
    with_plan_sizes,
)
from .ways import FloorMap, OpenFloor, planned_floor

__all__ = [
    "PLAN_SIZES",
    "FloorMap",
    "FloorPlan",
    "OpenFloor",
    "floor_plan",
    "floor_title",
    "plan_names",
    "plan_text",
    "planned_floor",
    "with_plan_sizes",
]
