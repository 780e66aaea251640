"""Items by what they have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

Item = TypeVar("Item")
Group = TypeVar("Group")


def grouped(items: Iterable[Item], by: Callable[[Item], Group]) -> dict[Group, list[Item]]:
    """Return the items by what they have in common, in order of appearance."""
    groups: dict[Group, list[Item]] = {}
    for item in items:
        groups.setdefault(by(item), []).append(item)
    return groups
