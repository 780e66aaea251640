"""A file of C that is made of kernels: what they need, and their functions in order."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from swarm_logistics_env.core.errors import PolicyError

from .c_expressions import python_function
from .c_parts import Parts
from .c_statements import KernelWriter
from .c_values import Function, Kind, Known, TupleOf, Value

# What is a double in simulation, and a function of math.h or a number of that kind.
_REALS = """\
#ifdef SWARM_DOUBLE
typedef double real;
#define REAL(name) name
#define REAL_BITS 53
#else
typedef float real;
#define REAL(name) name##f
#define REAL_BITS 24
#endif"""


class Program:
    """Collects kernels and what they call, each once.

    Args:
        exact: kernels whose numbers have to be of double precision.
        functions: those that are written by hand, by kernels; the kernels' texts do not count.
    """

    def __init__(
        self,
        exact: Sequence[Callable[..., Any]] = (),
        functions: Mapping[Callable[..., Any], Function] | None = None,
    ) -> None:
        self._exact = exact
        self._by_hand = dict(functions or {})
        self._parts = Parts()
        self._tuples: set[TupleOf] = set()
        self._functions: dict[tuple[object, ...], Function] = {}
        self._names: set[str] = set()
        self._alive: list[tuple[Value | Known, ...]] = []  # arguments: their ids are in keys

    def function(self, function: Any, arguments: Sequence[Value | Known]) -> Function:
        """Return the function of C for a kernel and such arguments; it is written once.

        Raises:
            PolicyError: it is no function of Python's, or something in it cannot be written in C.
        """
        kernel = python_function(function)
        if not inspect.isfunction(kernel):
            raise PolicyError(f"{function.__name__} is no function of Python's, so it has no C")
        if kernel in self._by_hand:
            written = self._by_hand[kernel]
            self._functions[kernel, "by hand"] = written
            return written
        kinds = (a.kind if isinstance(a, Value) else (a.name, id(a.value)) for a in arguments)
        key = (kernel, *kinds)
        if key not in self._functions:
            name = kernel.__name__.lstrip("_")
            while name in self._names:
                name += "_2"
            self._names.add(name)
            is_exact = kernel in self._exact
            wide: set[str] = set()
            is_settled = False
            while not is_settled:
                n_wide = len(wide)
                writer = KernelWriter(self._parts, self.function, kernel, name, is_exact, wide)
                written = writer.write(arguments)
                is_settled = len(wide) == n_wide
            self._note_tuples(written)
            self._functions[key] = written
            self._alive.append(tuple(arguments))
        return self._functions[key]

    def _note_tuples(self, function: Function) -> None:
        kinds: list[Kind | None] = [function.kind, *(kind for _, kind in function.parameters)]
        self._tuples |= {kind for kind in kinds if isinstance(kind, TupleOf)}

    def text(self) -> str:
        """Return all that was collected, as C."""
        constants, definitions = self._parts.texts()
        structures = [
            f"typedef struct {{\n    {kind.element.name} at[{kind.length}];\n}} {kind.name};"
            for kind in sorted(self._tuples, key=lambda kind: kind.name)
        ]
        functions = [function.text for function in self._functions.values()]
        return "\n\n".join([_REALS, *constants, *structures, *definitions, *functions])
