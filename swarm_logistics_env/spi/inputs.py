"""Checks of what callers pass in; each raises an IndicatorError that names field and value."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from typing import SupportsIndex, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import SwarmLogisticsError

Numbers: TypeAlias = NDArray[np.float64]


class IndicatorError(SwarmLogisticsError):
    """Input from which an indicator is undefined; the message names the field and the value."""


# Beyond these the squares of squares, which intervals are made of, are no numbers any more.
SMALLEST = 1e-60
LARGEST = 1e60


def performance(name: str, values: ArrayLike, *, or_trainings: bool = False) -> Numbers:
    """Performances as a float array (n,): not empty, finite, not negative, of a usual size.

    Args:
        or_trainings: whether (K trainings, n) will do as well, with two trainings or more.
    """
    array = numbers(name, values)
    if array.ndim != 1 and not (or_trainings and array.ndim == 2 and len(array) > 1):
        more = ", or a row for each of two trainings or more" * or_trainings
        raise IndicatorError(
            f"{name} has shape {array.shape}: should be one number per seed (or size), shape "
            f"(n,){more}"
        )
    if array.size == 0:
        raise IndicatorError(f"{name} is empty: should hold one number per seed (or size)")
    unusable = np.argwhere(~((array >= 0.0) & (array < math.inf)))
    if len(unusable):
        index = tuple(unusable[0].tolist())
        where = ", ".join(map(str, index))
        raise IndicatorError(f"{name}[{where}] = {array[index]:g}: should be finite, not negative")
    most = float(array.max())
    if most > LARGEST or 0.0 < most < SMALLEST:
        raise IndicatorError(
            f"{name} goes up to {most:g}: should go up to a number from {SMALLEST:g} to "
            f"{LARGEST:g}, or be 0; use another unit"
        )
    return array


def numbers(name: str, values: ArrayLike) -> Numbers:
    """A float array of any shape, of whole and real numbers, none of them masked."""
    try:
        rows = enumerate(values) if isinstance(values, list | tuple) else [(None, values)]
        for row, entries in rows:
            if np.ma.isMA(entries) and np.ma.getmaskarray(entries).any():
                first = np.argwhere(np.ma.getmaskarray(entries))[0].tolist()
                where = ", ".join(map(str, first if row is None else [row, *first]))
                raise IndicatorError(
                    f"{name}[{where}] is masked: should be left out, or be a number"
                )
        array = np.asarray(values)
        times = (np.timedelta64, np.datetime64)  # numpy would turn them into counts of some unit
        if array.dtype.kind in "cmM" or (
            array.dtype.kind == "O" and any(isinstance(element, times) for element in array.flat)
        ):
            what = "complex" if array.dtype.kind == "c" else "times of numpy or pandas"
            raise IndicatorError(
                f"{name} is of {what} ({array.dtype}): should be an array of real numbers, as "
                "seconds for times"
            )
        return np.asarray(array, dtype=np.float64)
    except OverflowError:
        raise IndicatorError(f"{name} has a number that is too large: up to {LARGEST:g}") from None
    except (TypeError, ValueError) as error:
        if isinstance(error, IndicatorError):
            raise
        raise IndicatorError(f"{name} = {values!r}: should be an array of numbers") from None


def same_seeds(**samples: Numbers) -> None:
    """Raise unless all samples have one performance for each of the same seeds (and trainings)."""
    if len({sample.shape for sample in samples.values()}) > 1:
        lengths = ", ".join(
            f"{name} has {' x '.join(map(str, sample.shape))}" for name, sample in samples.items()
        )
        raise IndicatorError(
            f"unequal seed sets ({lengths}): paired samples need the same seeds in the same order; "
            "pass paired=False for results that share no seeds"
        )


def positive_mean(name: str, sample: Numbers) -> None:
    """Raise where the mean that the indicator divides by is 0."""
    if not sample.any():
        raise IndicatorError(
            f"mean of {name} = 0: nothing was delivered in the reference, so no change relative "
            "to it is defined"
        )


def count(name: str, value: SupportsIndex) -> int:
    """A whole number of at least 1."""
    try:
        number = operator.index(value)
    except TypeError:
        raise IndicatorError(f"{name} = {value!r}: should be a whole number") from None
    if number < 1:
        raise IndicatorError(f"{name} = {number}: should be at least 1")
    return number


def finite(name: str, value: float) -> float:
    """A finite number."""
    number = _number(name, value)
    if not math.isfinite(number):
        raise IndicatorError(f"{name} = {value}: should be finite")
    return number


def between_0_and_1(name: str, value: float) -> float:
    """A number strictly between 0 and 1."""
    number = _number(name, value)
    if not 0.0 < number < 1.0:
        raise IndicatorError(f"{name} = {value}: should lie between 0 and 1, both excluded")
    return number


def delivery_times(name: str, runs: Sequence[ArrayLike]) -> list[Numbers]:
    """Return delivery times [s] of each seed, ascending: at least one seed, finite, 0 or more."""
    if len(runs) == 0:
        raise IndicatorError(f"{name} is empty: should hold the delivery times of each seed")
    checked = []
    for seed, run in enumerate(runs):
        times = numbers(f"{name}[{seed}]", run)
        if times.ndim != 1 or not np.isfinite(times).all() or (times < 0.0).any():
            raise IndicatorError(
                f"{name}[{seed}] = {run!r}: should be delivery times in s, finite, not negative"
            )
        checked.append(np.sort(times))
    return checked


def _number(name: str, value: float) -> float:
    try:
        math.isfinite(value)  # takes whatever turns into a float, unlike float() no text
    except (TypeError, OverflowError):
        raise IndicatorError(f"{name} = {value!r}: should be a number") from None
    return float(value)
