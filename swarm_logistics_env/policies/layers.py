"""The layers of a trained network in compiled loops; the number of rows changes no bit.

A sum is of one product after the other, in the order of the inputs, so a robot's command does not
depend on how many others there are, as it does with numpy's matrix product. Two rows and 32 outputs
are summed at once, as many as the registers of a processor hold; `register_blocks` is that part.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.compiler.register_blocks import (
    NARROW,
    ROWS,
    WIDE,
    sum_narrow_block,
    sum_wide_block,
)

Floats = NDArray[np.float32]


class Layers(NamedTuple):
    """The layers of a network as `run_network` reads them; layer l has widths[l] inputs."""

    weights: Annotated[Floats, "n_weights"]  # of all layers, `in_blocks`
    biases: Annotated[Floats, "n_biases"]  # `padded`
    widths: Annotated[NDArray[np.int64], "n_layers + 1"]


def in_blocks(weights: Floats) -> Floats:
    """Return weights (inputs, outputs) as `run_network` reads them: block after block of outputs.

    Of a block, the weights of an input lie side by side: wide blocks, then narrow ones, the last of
    which is filled up with zeros.
    """
    n_out = weights.shape[1]
    n_padded = -(-n_out // NARROW) * NARROW
    weights = np.pad(weights, ((0, 0), (0, n_padded - n_out)))
    n_wide = n_padded // WIDE * WIDE
    starts = [*range(0, n_wide, WIDE), *range(n_wide, n_padded, NARROW), n_padded]
    blocks = [weights[:, start:end].ravel() for start, end in pairwise(starts)]
    return np.concatenate(blocks)


def padded(biases: Floats) -> Floats:
    """Return the biases of a layer with zeros for the outputs that fill up its last block."""
    return np.pad(biases, (0, -len(biases) % NARROW))


@kernel
def hyperbolic_tangent(x: np.float32) -> np.float32:
    """Return tanh(x) to 3e-7: the rational function of Eigen's `ptanh` (float, [13/6]).

    Several at once, and the same bits on every machine, which a C library does not promise.
    """
    x = min(max(x, np.float32(-7.9053111)), np.float32(7.9053111))
    x2 = x * x
    numerator = np.float32(-2.76076847742355e-16)
    numerator = numerator * x2 + np.float32(2.00018790482477e-13)
    numerator = numerator * x2 + np.float32(-8.60467152213735e-11)
    numerator = numerator * x2 + np.float32(5.12229709037114e-08)
    numerator = numerator * x2 + np.float32(1.48572235717979e-05)
    numerator = numerator * x2 + np.float32(6.37261928875436e-04)
    numerator = numerator * x2 + np.float32(4.89352455891786e-03)
    denominator = np.float32(1.19825839466702e-06)
    denominator = denominator * x2 + np.float32(1.18534705686654e-04)
    denominator = denominator * x2 + np.float32(2.26843463243900e-03)
    denominator = denominator * x2 + np.float32(4.89352518554385e-03)
    return x * numerator / denominator


@kernel
def run_network(inputs: Floats, layers: Layers, outputs: Floats) -> None:
    """Fill `outputs` (N, widths[-1]) from `inputs` (N, widths[0])."""
    weights, biases, widths = layers
    n_rows = inputs.shape[0]
    n_layers = len(widths) - 1
    most = n_rows * -(-widths.max() // NARROW) * NARROW
    sums = np.empty(most, np.float32)
    hidden = np.empty(most, np.float32)
    values = inputs.reshape(-1)
    width_in = widths[0]
    weight = bias = width_out = 0
    for layer in range(n_layers):
        n_in = widths[layer]
        width_out = -(-widths[layer + 1] // NARROW) * NARROW
        output = 0
        while output < width_out:
            is_wide = output + WIDE <= width_out
            for row in range(0, n_rows, ROWS):
                # The last of an odd number of rows is summed twice.
                is_last = row + 1 == n_rows
                next_value, next_sum = (0, 0) if is_last else (width_in, width_out)
                value = row * width_in
                total = row * width_out + output
                if is_wide:
                    sum_wide_block(
                        values, value, next_value, n_in, weights, weight,
                        biases, bias + output, sums, total, next_sum,
                    )  # fmt: skip
                else:
                    sum_narrow_block(
                        values, value, next_value, n_in, weights, weight,
                        biases, bias + output, sums, total, next_sum,
                    )  # fmt: skip
            width = WIDE if is_wide else NARROW
            weight += n_in * width
            output += width
        bias += width_out
        if layer < n_layers - 1:
            for index in range(n_rows * width_out):
                hidden[index] = hyperbolic_tangent(sums[index])
            values = hidden
            width_in = width_out
    for row in range(n_rows):
        for output in range(widths[n_layers]):
            outputs[row, output] = sums[row * width_out + output]
