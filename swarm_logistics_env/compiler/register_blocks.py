"""Weighted sums of two rows and a block of outputs at once, as many as registers hold.

Numba's own loops keep the sums in memory, so this part is made of LLVM's vector instructions: see
`numba_fence`. Each sum is of one product after the other, in the order of the inputs, rounded after
each step, as `_by_loops` says in Python: both have the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.compiler.numba_fence import IS_INTERPRETED

_LANES = 8  # floats in a register

if TYPE_CHECKING or not IS_INTERPRETED:
    from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
    from numba.core import types
    from numba.extending import intrinsic
    from numba.np import arrayobj

    make_array: Any = arrayobj.make_array  # without types
    _COUNT = ir.IntType(64)
    _VECTOR = ir.VectorType(ir.FloatType(), _LANES)

Floats = NDArray[np.float32]
SumBlock = Callable[[Floats, int, int, int, Floats, int, Floats, int, Floats, int, int], None]

ROWS = 2
WIDE = 32  # outputs of a block
NARROW = 8
_ARRAYS = (0, 4, 6, 8)  # which of the arguments are arrays


def _by_loops(width: int) -> SumBlock:
    def sum_block(
        values: Floats,
        first_value: int,
        next_value: int,
        n_in: int,
        weights: Floats,
        first_weight: int,
        biases: Floats,
        first_bias: int,
        sums: Floats,
        first_sum: int,
        next_sum: int,
    ) -> None:
        """Fill two rows of `sums` with biases + values x weights.

        Args:
            values, first_value, next_value: the inputs of the first row begin at `first_value`,
                those of the other `next_value` behind it; 0: there is no other.
            n_in: number of inputs.
            weights, first_weight: the weights of each input, one for each output, side by side.
            biases, first_bias: a bias of each output.
            sums, first_sum, next_sum: where the sums begin, as `values`.
        """
        for row in range(ROWS if next_sum > 0 else 1):
            start = first_sum + row * next_sum
            total = sums[start : start + width]
            total[:] = biases[first_bias : first_bias + width]
            for index in range(n_in):
                value = values[first_value + row * next_value + index]
                weight = first_weight + index * width
                total += value * weights[weight : weight + width]

    return kernel(sum_block)


def _in_registers(width: int) -> SumBlock:
    """Return the same as `_by_loops`, made of vector instructions."""
    n_vectors = width // _LANES

    def typed(
        typing_context: Any, values: Any, first_value: Any, next_value: Any, n_in: Any,
        weights: Any, first_weight: Any, biases: Any, first_bias: Any, sums: Any, first_sum: Any,
        next_sum: Any,
    ) -> Any:  # fmt: skip
        int64 = types.int64
        return types.void(
            values, int64, int64, int64, weights, int64, biases, int64, sums, int64, int64
        ), generate

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values, weights, biases, sums = (
            make_array(signature.args[index])(context, builder, arguments[index]).data
            for index in _ARRAYS
        )
        first_value, next_value, n_in, first_weight, first_bias, first_sum, next_sum = (
            argument for index, argument in enumerate(arguments) if index not in _ARRAYS
        )

        def number(value: int) -> Any:
            return ir.Constant(_COUNT, value)

        def vectors_at(pointer: Any, first: Any) -> list[Any]:
            indices = (builder.add(first, number(_LANES * vector)) for vector in range(n_vectors))
            return [
                builder.bitcast(builder.gep(pointer, [index]), _VECTOR.as_pointer())
                for index in indices
            ]

        def load(pointer: Any) -> Any:
            return builder.load(pointer, align=4)

        def in_all_lanes(value: Any) -> Any:
            first_lane = ir.Constant(ir.IntType(32), 0)
            lane = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, first_lane)
            zeros = ir.Constant(ir.VectorType(ir.IntType(32), _LANES), [0] * _LANES)
            return builder.shuffle_vector(lane, ir.Constant(_VECTOR, ir.Undefined), zeros)

        initial = [load(pointer) for pointer in vectors_at(biases, first_bias)]
        before = builder.block
        head, body, end = (builder.append_basic_block(name) for name in ("head", "body", "end"))
        builder.branch(head)

        builder.position_at_end(head)
        index = builder.phi(_COUNT)
        totals = [[builder.phi(_VECTOR) for _ in initial] for _ in range(ROWS)]
        index.add_incoming(number(0), before)
        for row_totals in totals:
            for total, bias in zip(row_totals, initial):
                total.add_incoming(bias, before)
        builder.cbranch(builder.icmp_signed("<", index, n_in), body, end)

        builder.position_at_end(body)
        first = builder.add(first_weight, builder.mul(index, number(width)))
        weights_of_input = [load(pointer) for pointer in vectors_at(weights, first)]
        for row_number, row_totals in enumerate(totals):
            start = builder.add(first_value, builder.mul(next_value, number(row_number)))
            value = in_all_lanes(builder.load(builder.gep(values, [builder.add(start, index)])))
            for total, weight in zip(row_totals, weights_of_input):
                total.add_incoming(builder.fadd(total, builder.fmul(value, weight)), body)
        index.add_incoming(builder.add(index, number(1)), body)
        builder.branch(head)

        builder.position_at_end(end)
        for row_number, row_totals in enumerate(totals):
            start = builder.add(first_sum, builder.mul(next_sum, number(row_number)))
            for total, pointer in zip(row_totals, vectors_at(sums, start)):
                builder.store(total, pointer, align=4)
        return context.get_dummy_value()

    return cast("SumBlock", intrinsic(typed))


_sum_block = _by_loops if IS_INTERPRETED else _in_registers
sum_wide_block = _sum_block(WIDE)
sum_narrow_block = _sum_block(NARROW)
