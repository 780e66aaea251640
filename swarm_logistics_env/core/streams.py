"""Random streams keyed by seed, purpose and entity (common random numbers).

A stream depends on its key alone. It does not depend on the swarm size, the process, the order of
calls or any other world. So robot 3 starts in the same place whether 5 or 150 robots follow it,
and removing it changes no other robot's stream.
"""

from __future__ import annotations

import hashlib
import operator

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import SetupError


def key(seed: int, purpose: str, *entity: int) -> int:
    """Return the 64-bit key of a stream.

    Args:
        seed: any integer; 0 is a seed like every other.
        purpose: the use of the numbers, e.g. "item places".
        entity: integers that name what the numbers belong to, e.g. the robot's number.

    Raises:
        SetupError: `seed` is not an integer.
    """
    try:
        number = operator.index(seed)
    except TypeError:
        raise SetupError(f"seed = {seed!r}: should be an integer") from None
    text = "/".join([str(number), purpose, *(str(int(part)) for part in entity)])
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")


def generator(seed: int, purpose: str, *entity: int) -> np.random.Generator:
    """Return a numpy Generator (Philox) for the stream of that key; see `key`."""
    return np.random.Generator(np.random.Philox(key=key(seed, purpose, *entity)))


def row_keys(seed: int, purpose: str, n_rows: int) -> NDArray[np.uint64]:
    """Return one key per row (robot), shape (n_rows,), for the counter-based kernel streams.

    Row i's key does not depend on `n_rows`.
    """
    rows = np.arange(1, n_rows + 1, dtype=np.uint64)
    value = rows * np.uint64(0x9E3779B97F4A7C15) + np.uint64(key(seed, purpose))
    # The output function of SplitMix64 (Steele, Lea, Flood 2014); `uniform` in kernels is its twin.
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray(value ^ (value >> np.uint64(31)), dtype=np.uint64)
