"""Floors: plans of warehouses with racks, walls and docks. `ways`, which is compiled, is apart."""

from .floor_plan import (
    PLAN_SIZES,
    FloorPlan,
    floor_plan,
    floor_title,
    plan_names,
    plan_text,
    with_plan_sizes,
)

__all__ = [
    "PLAN_SIZES",
    "FloorPlan",
    "floor_plan",
    "floor_title",
    "plan_names",
    "plan_text",
    "with_plan_sizes",
]
