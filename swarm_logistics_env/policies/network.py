"""A feed-forward network in compiled loops, without torch; each row is computed on its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import kernel


class FeedForward:
    """Dense layers with `tanh` or ReLU between them, in float32.

    Loops rather than numpy's matrix product, whose bits differ with the number of rows: here a
    robot's command does not depend on how many others there are.

    Args:
        weights: one (outputs, inputs) array per layer, as torch has them.
        biases: one (outputs,) array per layer.
        rectify: ReLU instead of tanh.
    """

    def __init__(
        self,
        weights: Sequence[NDArray[np.float32]],
        biases: Sequence[NDArray[np.float32]],
        *,
        rectify: bool,
    ) -> None:
        # Transposed, so that a layer's outputs, over which the inner loop runs, lie side by side.
        self._weights = np.concatenate([np.ascontiguousarray(w.T).ravel() for w in weights])
        self._biases = np.concatenate(list(biases))
        self._widths = np.array([weights[0].shape[1], *(len(bias) for bias in biases)])
        self._rectify = rectify

    def __call__(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the outputs (N, outputs) for rows of at least `inputs` columns; it reads these."""
        outputs = np.empty((inputs.shape[0], self._widths[-1]), np.float32)
        run_network(inputs, self._weights, self._biases, self._widths, self._rectify, outputs)
        return outputs


@kernel
def hyperbolic_tangent(x: np.float32) -> np.float32:
    """Return tanh(x) to 3e-7: the rational function of Eigen's `ptanh` (float, [13/6]).

    Several at once, and the same bits on every machine, which a C library does not promise.
    """
    x = min(max(x, np.float32(-7.9053111)), np.float32(7.9053111))
    x2 = x * x
    over = np.float32(-2.76076847742355e-16)
    over = over * x2 + np.float32(2.00018790482477e-13)
    over = over * x2 + np.float32(-8.60467152213735e-11)
    over = over * x2 + np.float32(5.12229709037114e-08)
    over = over * x2 + np.float32(1.48572235717979e-05)
    over = over * x2 + np.float32(6.37261928875436e-04)
    over = over * x2 + np.float32(4.89352455891786e-03)
    under = np.float32(1.19825839466702e-06)
    under = under * x2 + np.float32(1.18534705686654e-04)
    under = under * x2 + np.float32(2.26843463243900e-03)
    under = under * x2 + np.float32(4.89352518554385e-03)
    return x * over / under


@kernel
def run_network(
    inputs: NDArray[np.float32],
    weights: NDArray[np.float32],
    biases: NDArray[np.float32],
    widths: NDArray[np.int64],
    rectify: bool,
    outputs: NDArray[np.float32],
) -> None:
    """Fill `outputs` (N, widths[-1]); layer l has widths[l] inputs."""
    n_layers = len(widths) - 1
    widest = widths.max()
    here, there = np.empty(widest, np.float32), np.empty(widest, np.float32)
    for row in range(inputs.shape[0]):
        here[: widths[0]] = inputs[row, : widths[0]]
        weight, bias = 0, 0
        for layer in range(n_layers):
            n_in, n_out = widths[layer], widths[layer + 1]
            total = there[:n_out]
            total[:] = biases[bias : bias + n_out]
            for place in range(n_in):
                value = here[place]
                # Most inputs are zero, because most things are not in view.
                if value != np.float32(0.0):
                    column = weights[weight : weight + n_out]
                    for out in range(n_out):
                        total[out] += value * column[out]
                weight += n_out
            bias += n_out
            if layer < n_layers - 1:
                if rectify:
                    for place in range(n_out):
                        total[place] = max(total[place], np.float32(0.0))
                else:
                    for place in range(n_out):
                        total[place] = hyperbolic_tangent(total[place])
            here, there = there, here
        outputs[row] = here[: widths[n_layers]]
