"""The layers of a network in compiled loops: a sum is of one product after the other."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, cast

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.compiler import register_blocks
from swarm_logistics_env.policies.layers import (
    Layers,
    hyperbolic_tangent,
    in_blocks,
    padded,
    run_network,
)

Floats = NDArray[np.float32]
compile_fresh: Any = numba.njit
rng = np.random.default_rng(0)


def drawn(*shape: int) -> Floats:
    return rng.normal(0, 0.3, shape).astype(np.float32)


def one_after_the_other(inputs: Floats, weights: list[Floats], biases: list[Floats]) -> Floats:
    """Return a network's outputs, each product added in the order of the inputs."""
    values = inputs
    for layer, (weight, bias) in enumerate(zip(weights, biases)):
        sums = np.tile(bias, (len(values), 1))
        for index in range(weight.shape[0]):
            sums = sums + values[:, index : index + 1] * weight[index]
        values = sums
        if layer < len(weights) - 1:
            tangents = [hyperbolic_tangent(value) for value in sums.ravel()]
            values = np.array(tangents, np.float32).reshape(sums.shape)
    return values


@pytest.mark.parametrize("widths", [(5, 40, 3), (3, 70, 9, 2), (4, 1)])
@pytest.mark.parametrize("n_rows", [1, 2, 7])
def test_outputs_have_the_bits_of_products_added_one_after_the_other(
    widths: tuple[int, ...], n_rows: int
) -> None:
    weights = [drawn(n_in, n_out) for n_in, n_out in pairwise(widths)]
    biases = [drawn(n_out) for n_out in widths[1:]]
    inputs, outputs = drawn(n_rows, widths[0]), np.empty((n_rows, widths[-1]), np.float32)
    blocks, padded_biases = map(in_blocks, weights), map(padded, biases)
    layers = Layers(
        np.concatenate(list(blocks)), np.concatenate(list(padded_biases)), np.array(widths)
    )
    run_network(inputs, layers, outputs)
    expected = one_after_the_other(inputs, weights, biases)
    np.testing.assert_array_equal(outputs.view(np.uint32), expected.view(np.uint32))


@pytest.mark.daily
@pytest.mark.compiled
@pytest.mark.parametrize("width", [register_blocks.NARROW, register_blocks.WIDE])
def test_registers_and_loops_have_the_same_bits(width: int) -> None:
    n_in = 11
    arrays = drawn(2 * n_in + 3), drawn(n_in * width + 5), drawn(width + 2)
    sums = []
    for make in (register_blocks._by_loops, register_blocks._in_registers):
        block = cast("Any", make(width))

        @compile_fresh  # type: ignore[untyped-decorator]  # numba's
        def fill(values: Floats, weights: Floats, biases: Floats, total: Floats) -> None:
            block(values, 3, n_in, n_in, weights, 5, biases, 2, total, 1, width)  # noqa: B023

        total = np.zeros(2 * width + 2, np.float32)
        fill(*arrays, total)
        sums.append(total)
    np.testing.assert_array_equal(sums[0].view(np.uint32), sums[1].view(np.uint32))
    assert sums[0][0] == sums[0][-1] == 0.0
    assert np.count_nonzero(sums[0]) == 2 * width
