"""Arrays whose memory is reused."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_MOST_KEPT = 4


def _references(arrays: Sequence[NDArray[np.float32]], place: int) -> int:
    return sys.getrefcount(arrays[place])


# The number of references to an array that only a list holds. It is counted here, because a call
# adds another number of references in each version of Python.
_HELD_BY_NOBODY = _references([np.empty(0, np.float32)], 0)


class Buffers:
    """Returns arrays; an old array is returned again once nothing refers to it or to a part of it.

    The system would give new memory of this size page by page, and would take it back at once. With
    two threads this costs as much as stepping a world.

    Args:
        shape: the shape of every array; the dtype is float32.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape
        self._kept: list[NDArray[np.float32]] = []

    def zeros(self) -> NDArray[np.float32]:
        """Return an array of zeros, which belongs to the caller."""
        array = self.used()
        array.fill(0.0)
        return array

    def used(self) -> NDArray[np.float32]:
        """Return an array with its old contents, which belongs to the caller."""
        for place in range(len(self._kept)):
            if _references(self._kept, place) == _HELD_BY_NOBODY:
                return self._kept[place]
        new = np.zeros(self._shape, np.float32)
        self._kept = [*self._kept[1 - _MOST_KEPT :], new]
        return new
