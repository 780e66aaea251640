"""Arrays whose memory is used again."""

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
    """Hands out arrays, an old one as soon as nobody holds it or a part of it.

    New memory of this size comes from the system page by page and goes back at once, which with
    two threads costs as much as stepping a world.

    Args:
        shape: of every array, float32.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._shape = shape
        self._kept: list[NDArray[np.float32]] = []

    def zeros(self) -> NDArray[np.float32]:
        """Return an array of zeros of the caller's own."""
        array = self.used()
        array.fill(0.0)
        return array

    def used(self) -> NDArray[np.float32]:
        """Return an array of the caller's own, that holds what it held before."""
        for place in range(len(self._kept)):
            if _references(self._kept, place) == _HELD_BY_NOBODY:
                return self._kept[place]
        new = np.zeros(self._shape, np.float32)
        self._kept = [*self._kept[1 - _MOST_KEPT :], new]
        return new
