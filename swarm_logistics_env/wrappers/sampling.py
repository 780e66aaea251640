"""Quantities of an episode that are fixed, one of a list, or drawn from a distribution."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from swarm_logistics_env.errors import SetupError

Distribution = Callable[[np.random.Generator], Any]


class Sampler:
    """Samples a value for each episode.

    Args:
        name: the name of the quantity, for errors.
        given: one value for all episodes; a list or array to draw from, each value equally
            likely; or a function of a numpy Generator.
        within: (least, greatest) value that the function returns; required with a function.

    Raises:
        SetupError: the list is empty, or a function comes without `within`.
    """

    def __init__(self, name: str, given: Any, within: tuple[Any, Any] | None = None) -> None:
        self._name, self._given, self._within = name, given, within
        self.ends: tuple[Any, ...]  # the values that are least and greatest are among these
        if callable(given):
            if not isinstance(within, tuple | list) or len(within) != 2:
                raise SetupError(
                    f"within = {within!r}: should be (least, greatest), the bounds of what the "
                    f"distribution of {name} gives"
                )
            self.ends = tuple(within)
        elif isinstance(given, list | np.ndarray):
            self.ends = tuple(_plain(value) for value in given)
        else:
            self.ends = (_plain(given),)
        if not self.ends:
            raise SetupError(f"{name} = []: should list at least one value")
        if within is not None and not callable(given):
            raise SetupError(f"within = {within!r}: should be None but for a distribution")

    def sample(self, rng: np.random.Generator) -> Any:
        """Return the value of an episode.

        Raises:
            SetupError: the function returned a value that is not within its bounds.
        """
        if not callable(self._given):
            return self.ends[int(rng.integers(len(self.ends)))]
        value = _plain(self._given(rng))
        least, greatest = self.ends
        try:
            is_within = bool(least <= value <= greatest)
        except (TypeError, ValueError):
            is_within = False
        if not is_within:
            raise SetupError(
                f"{self._name} = {value!r}: the distribution should give numbers within "
                f"{self._within}"
            )
        return value


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
