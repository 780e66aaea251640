"""What prepares rows for a network, as its training did: means and deviations, with a limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError

Rows = NDArray[np.float32]


def normalizer_of(normalize: Any) -> Callable[[Rows], Any]:
    """Return what prepares rows.

    Raises:
        PolicyError: `normalize` is nothing that `policies.of` takes, or its numbers cannot be.
    """
    if normalize is None:
        return _unchanged
    normalize = _vec_normalize_in(normalize)
    # Not by getattr: a VecNormalize from a file asks an environment that it does not have.
    attributes = getattr(normalize, "__dict__", {})
    if not attributes.get("norm_obs", True):
        return _unchanged
    statistics = attributes.get("obs_rms", normalize)
    if isinstance(statistics, dict):
        raise PolicyError(
            f"normalize: is of observations in several parts, {', '.join(statistics)}: should be "
            "of rows, as a robot's observation is one"
        )
    if hasattr(statistics, "var") and not callable(statistics.var):
        running = _Running(statistics, attributes.get("epsilon", 1e-8))
        scaled = Scaled(running, attributes.get("clip_obs", np.inf))
    elif isinstance(normalize, tuple | list) and len(normalize) == 2:
        mean, deviation = normalize
        scaled = Scaled(_Fixed(mean, deviation), np.inf)
    elif callable(normalize) and not isinstance(normalize, type):
        prepare: Callable[[Rows], Any] = normalize
        return prepare
    else:
        raise PolicyError(
            f"normalize = {normalize!r}: should be None, a function of rows, a pair (mean, "
            "standard deviation) or a VecNormalize of stable-baselines3"
        )
    return scaled


def _vec_normalize_in(normalize: Any) -> Any:
    """Return the VecNormalize that an environment of stable-baselines3 is or has within."""
    env = normalize
    while env is not None:
        attributes = getattr(env, "__dict__", {})
        if "norm_obs" in attributes:
            return env
        env = attributes.get("venv")
    return normalize


def _unchanged(rows: Rows) -> Rows:
    return rows


@dataclass
class _Fixed:
    """A mean and a standard deviation, (D,) or one number for all."""

    mean: Any
    deviation: Any


@dataclass
class _Running:
    """The mean and standard deviation of statistics as they are now: a training may go on."""

    statistics: Any
    epsilon: float

    @property
    def mean(self) -> Any:
        return self.statistics.mean

    @property
    def deviation(self) -> Any:
        return np.sqrt(np.asarray(self.statistics.var) + self.epsilon)


class Scaled:
    """Rows less their mean, in standard deviations, cut at a limit; rows of zeros stay zeros.

    Args:
        statistics: with mean and deviation, each (D,), or one number for all.
        limit: of what comes out, on either side of zero.

    Attributes:
        width: D; None: rows may have any length.

    Raises:
        PolicyError: a number is not finite, a deviation is not above zero, or the shapes differ.
    """

    def __init__(self, statistics: _Fixed | _Running, limit: float) -> None:
        self._statistics = statistics
        self._limit = limit
        mean, deviation = self._numbers()
        shapes = {mean.shape, deviation.shape} - {()}
        if len(shapes) > 1 or any(len(shape) > 1 for shape in shapes):
            raise PolicyError(
                f"normalize: its mean has shape {mean.shape} and its deviation "
                f"{deviation.shape}: should be one number for each column of a row"
            )
        if not (np.isfinite(mean).all() and (deviation > 0.0).all()):
            raise PolicyError(
                "normalize: should have a finite mean and a deviation above zero in every column"
            )
        self.width = shapes.pop()[0] if shapes else None

    def _numbers(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        try:
            mean, deviation = (
                np.squeeze(np.array(numbers, np.float64))
                for numbers in (self._statistics.mean, self._statistics.deviation)
            )
        except (TypeError, ValueError):
            raise PolicyError(
                f"normalize = {self._statistics!r}: should be arrays of numbers, mean and "
                "standard deviation"
            ) from None
        return mean, deviation

    def __call__(self, rows: Rows) -> Rows:
        if self.width not in (None, rows.shape[1]):
            raise PolicyError(
                f"normalize: its statistics have shape {(self.width,)}, and rows here "
                f"{rows.shape[1:]}: should be of the rows that the network learned with"
            )
        mean, deviation = self._numbers()
        scaled = np.clip((rows - mean) / deviation, -self._limit, self._limit)
        return np.where(rows.any(axis=1, keepdims=True), scaled, 0.0).astype(np.float32)
