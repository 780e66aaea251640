"""What compiled code does with addresses: it calls C, shares integers, and reads structures there.

A C function is called without the interpreter: an address that is a number at run time, unlike a
pointer that is a constant of the compiled code, leaves the kernel fit for the cache on disk. All of
it is made of LLVM's instructions by parts of numba that may change: see `numba_fence`, and
`interpreted_addresses` for the same by the interpreter.
"""

from __future__ import annotations

import functools
import itertools
import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from llvmlite import ir  # type: ignore[import-untyped]  # it ships none
from numba import core
from numba.core import types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numba.np import arrayobj
from numba.np.numpy_support import from_dtype

from .packing import field_kinds

S = TypeVar("S", bound=tuple[Any, ...])
cgutils: Any = core.cgutils  # without types
_WORD = ir.IntType(64)
_BYTES = 8
# System V on x86-64 and AAPCS64 on arm64 pass a structure of two words, all integers or all
# doubles, exactly as two arguments; Windows on x86-64 passes its address.
_BY_REFERENCE = sys.platform == "win32" and "ARM" not in sys.version.upper()


def _generated(function: Callable[..., Any]) -> Callable[..., int]:
    return cast("Callable[..., int]", intrinsic(function))


def _calling(kind: Any) -> Callable[..., int]:
    is_void = kind == types.void
    returned = ir.VoidType() if is_void else _WORD

    def typed(typing_context: Any, address: types.Type, arguments: types.Type) -> Any:
        arguments = cast("Any", types).unliteral(arguments)
        return kind(types.int64, arguments), generate

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        where, packed = values
        arguments_of_c: list[Any] = []
        passed = cgutils.unpack_tuple(builder, packed)
        for argument, value in zip(signature.args[1], passed, strict=True):
            if not isinstance(argument, types.BaseTuple):
                arguments_of_c.append(value)
            elif _BY_REFERENCE:
                arguments_of_c.append(cgutils.alloca_once_value(builder, value))
            else:
                arguments_of_c += cgutils.unpack_tuple(builder, value)
        function = ir.FunctionType(returned, [value.type for value in arguments_of_c])
        answer = builder.call(builder.inttoptr(where, function.as_pointer()), arguments_of_c)
        return context.get_dummy_value() if is_void else answer

    return _generated(typed)


# Both call the C function at an address with a tuple of arguments. Each is an integer (of any width
# up to 64 bits, or a pointer), a double, or a tuple of two of the same kind: a structure of 16
# bytes passed by value. The first returns nothing, the second the pointer that it is given.
call_at = _calling(types.void)
made_at = _calling(types.int64)


@_generated
def pointer_at(typing_context: Any, address: types.Type) -> Any:
    """Return `address` as the pointer that `numba.carray` takes."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), generate


_IN_ORDER = "seq_cst"  # all threads see all changes in one order


def _word_of(builder: Any, address: Any, index: Any) -> Any:
    return builder.gep(builder.inttoptr(address, _WORD.as_pointer()), [index])


@_generated
def load_word(typing_context: Any, address: types.Type, index: types.Type) -> Any:
    """Return a word, by its index in those at `address`."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load_atomic(_word_of(builder, *values), _IN_ORDER, _BYTES)

    return types.int64(types.int64, types.int64), generate


def _changed_by(operation: str) -> Callable[..., int]:
    def typed(typing_context: Any, address: types.Type, index: types.Type, by: types.Type) -> Any:
        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            *where, value = values
            return builder.atomic_rmw(operation, _word_of(builder, *where), value, _IN_ORDER)

        return types.int64(types.int64, types.int64, types.int64), generate

    return _generated(typed)


# Both take an address, the index of a word there, and an integer, which is stored in it or added
# to it; they return the old value.
exchange = _changed_by("xchg")
add = _changed_by("add")


@_generated
def replace(
    typing_context: Any, address: types.Type, index: types.Type, old: types.Type, new: types.Type
) -> Any:
    """Put `new` into a word, by its place, if `old` is there; returns whether it was."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        *where, was, becomes = values
        word = _word_of(builder, *where)
        exchanged = builder.cmpxchg(word, was, becomes, _IN_ORDER, _IN_ORDER)
        return builder.extract_value(exchanged, 1)

    return types.boolean(*[types.int64] * 4), generate


class StructureAt(types.Type):
    """The type that compiled code has of a structure: the address of its words.

    So a kernel hands a structure on as one word, and reads of it what it uses.
    """

    def __init__(self, structure: type) -> None:
        self.structure = structure
        super().__init__(f"{structure.__module__}.{structure.__qualname__} at an address")


@register_model(StructureAt)
class _Address(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: StructureAt) -> None:
        super().__init__(manager, kind, _WORD)  # type: ignore[no-untyped-call]  # numba's


@infer_getattr
class _Fields(AttributeTemplate):
    key = StructureAt

    def generic_resolve(self, kind: Any, name: str) -> Any:  # type: ignore[override]  # not typed
        field = _places(kind.structure).get(name)
        return None if field is None else field[0]


@cast("Callable[..., Callable[[type[S], int], S]]", intrinsic)
def unpacked_at(typing_context: Any, structure: Any, address: types.Type) -> Any:
    """Return the structure whose words `packed` has put at `address`."""
    kind = StructureAt(structure.instance_class)
    return kind(structure, types.int64), lambda context, builder, signature, values: values[1]


@cast("Any", lower_getattr_generic)(StructureAt)  # type: ignore[untyped-decorator]  # numba's
def _field(context: Any, builder: Any, kind: StructureAt, address: Any, name: str) -> Any:
    field, before = _places(kind.structure)[name]
    if isinstance(field, StructureAt):
        return builder.add(address, ir.Constant(_WORD, _BYTES * before))
    places = itertools.count(before)

    def word() -> Any:
        loaded = builder.load(_word_of(builder, address, ir.Constant(_WORD, next(places))))
        # No kernel changes the words, so LLVM need not read them again after stores elsewhere.
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        return loaded

    return _loaded(context, builder, field, word)


@functools.cache
def _places(structure: type) -> dict[str, tuple[Any, int]]:
    """Return of each field its type in compiled code, and how many words stand before it."""
    places = {}
    before = 0
    for name, kind in field_kinds(structure).items():
        places[name] = (_compiled_type(kind), before)
        before += _n_words(kind)
    return places


def _n_words(kind: Any) -> int:
    if isinstance(kind, tuple):
        return 1 + len(kind[1])
    return 1 if kind in (float, int, bool) else sum(map(_n_words, field_kinds(kind).values()))


def _compiled_type(kind: Any) -> Any:
    if isinstance(kind, tuple):
        return types.Array(from_dtype(kind[0]), len(kind[1]), "C")
    scalars = {float: types.float64, int: types.int64, bool: types.boolean}
    return scalars.get(kind) or StructureAt(kind)


def _loaded(context: Any, builder: Any, kind: Any, word: Callable[[], Any]) -> Any:
    if kind == types.float64:
        return builder.bitcast(word(), ir.DoubleType())
    if kind == types.boolean:
        return builder.icmp_signed("!=", word(), ir.Constant(_WORD, 0))
    if kind == types.int64:
        return word()
    array = context.make_array(kind)(context, builder)
    data = builder.inttoptr(word(), array.data.type)
    shape = [word() for _ in range(kind.ndim)]
    width = context.get_abi_sizeof(context.get_data_type(kind.dtype))
    itemsize = ir.Constant(_WORD, width)
    strides = [itemsize] if kind.ndim == 1 else [builder.mul(shape[1], itemsize), itemsize]
    cast("Any", arrayobj).populate_array(array, data, shape, strides, itemsize, meminfo=None)
    return array._getvalue()
