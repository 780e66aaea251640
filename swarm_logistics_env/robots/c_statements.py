"""Statements of kernels in C: a function of C for each kernel, with its names and comments."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np

from swarm_logistics_env.core.errors import PolicyError

from .c_expressions import Expressions, FunctionOf
from .c_layout import INDENT, comment_lines, comments_of, declared, wrapped_lines
from .c_parts import Parts
from .c_values import (
    ATOM,
    BOOL,
    DOUBLE,
    FLOAT,
    INT,
    REAL,
    ArrayOf,
    Function,
    Kind,
    Known,
    NoCError,
    TupleOf,
    Value,
    constant,
    converted,
    stored,
)
from .c_variables import homes_of


class KernelWriter(Expressions):
    """Writes one kernel, for arguments of some kinds, as a function of C.

    Args:
        parts: where what it needs is collected.
        function_of: returns the function of C for a kernel that this one calls.
        function: the kernel in Python.
        name: of the function in C.
        is_exact: whether its numbers have to be of double precision.
        wide: variables that begin with a float and are a real later, as they are from the first
            on; those that are new come in, and then the function has to be written again.
    """

    def __init__(
        self,
        parts: Parts,
        function_of: FunctionOf,
        function: Callable[..., Any],
        name: str,
        is_exact: bool,
        wide: set[str],
    ) -> None:
        real = DOUBLE if is_exact else REAL
        super().__init__(parts, function_of, function.__globals__, real)
        self._name = name
        self._wide = wide
        self._file = f"{function.__module__}.{function.__name__}"
        source = textwrap.dedent(inspect.getsource(function))
        definition = ast.parse(source).body[0]
        assert isinstance(definition, ast.FunctionDef)
        self._definition = definition
        self._comments = comments_of(source)
        self._lines: list[str] = []
        self._depth = 1
        self._returned: Kind | None = None
        self._kinds: dict[str, Kind] = {}
        self._homes = homes_of(definition)
        self._reads = {
            node.id
            for node in ast.walk(definition)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
        }
        self._n_results = 0

    def write(self, arguments: Sequence[Value | Known]) -> Function:
        """Return the function for such arguments.

        Raises:
            PolicyError: something in the kernel cannot be written in C.
        """
        names = [argument.arg for argument in self._definition.args.args]
        for name, argument in zip(names, arguments, strict=True):
            self._variables[name] = argument
            if isinstance(argument, Value):
                self._kinds[name] = self._kind_of(name, argument.kind)
                self._variables[name] = Value(name, self._kinds[name], root=name)
        body = self._definition.body
        description = ast.get_docstring(self._definition) or ""
        self._comments = {n: text for n, text in self._comments.items() if n >= body[0].lineno}
        self._write_block(body[1:] if description else body)
        parameters = tuple(
            (number, self._kinds[name])
            for number, name in enumerate(names)
            if isinstance(arguments[number], Value) and name in self._used
        )
        written = frozenset(n for n, name in enumerate(names) if name in self._written)
        texts = [declared(names[n], kind, is_constant=n not in written) for n, kind in parameters]
        kind = "void" if self._returned is None else self._returned.name  # type: ignore[union-attr]
        head = f"static {kind} {self._name}({', '.join(texts) or 'void'})"
        lines = [*wrapped_lines(f"{head} {{"), *self._finished_lines(), "}"]
        comment = comment_lines(description.partition("\n\nArgs:")[0], "")
        text = "\n".join([*comment, *lines])
        return Function(self._name, self._returned, parameters, written, text)

    def _finished_lines(self) -> Iterator[str]:
        """Yield the lines, with what is known only at the end of the function."""
        for line in self._lines:
            if line.startswith("declare "):
                _, depth, name = line.split()
                kind = self._kinds.get(name)
                if kind is not None:
                    zero = " = {{0}}" if isinstance(kind, TupleOf) else " = 0"
                    yield f"{INDENT * int(depth)}{declared(name, kind)}{zero};"
                continue
            if line.lstrip().startswith(("/*", "*")):
                yield line
                continue
            for root in self._kinds:
                qualifier = "" if root in self._written else "const "
                line = line.replace(f"<const {root}>", qualifier)
            yield from wrapped_lines(line)

    def _emit(self, text: str) -> None:
        self._lines.append(INDENT * self._depth + text)

    def _write_block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            self._write_comments(statement.lineno)
            for name, homes in self._homes.items():
                for home in homes:
                    if home.statement is statement and not home.is_declared_there:
                        self._lines.append(f"declare {self._depth} {name}")
            try:
                self._write_statement(statement)
            except NoCError as error:
                line = ast.unparse(statement).partition("\n")[0]
                raise PolicyError(f"{self._file}: no C for `{line}`: {error}") from None

    def _write_comments(self, line: int) -> None:
        """Write the comments of Python that stand before a statement or beside it."""
        for number in sorted(n for n in self._comments if n <= line):
            self._lines += comment_lines(self._comments.pop(number), INDENT * self._depth)

    def _write_statement(self, statement: ast.stmt) -> None:
        self._statement = statement
        match statement:
            case ast.Assign(targets=[target], value=value):
                self._assign(target, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, value)
            case ast.AugAssign():
                self._change(statement)
            case ast.Expr(value=ast.Call() as call):
                self._emit(f"{self.value_of(call).text};")
            case ast.If():
                self._write_if(statement)
            case ast.For():
                self._write_for(statement)
            case ast.Return():
                self._write_return(statement.value)
            case ast.Break() | ast.Continue():
                self._emit("break;" if isinstance(statement, ast.Break) else "continue;")
            case _:
                raise NoCError(type(statement).__name__)

    def _write_braces(self, head: str, statements: Sequence[ast.stmt]) -> None:
        self._emit(head)
        self._depth += 1
        self._write_block(statements)
        self._depth -= 1

    def _write_if(self, statement: ast.If) -> None:
        condition = converted(self.value_of(statement.test), BOOL)
        if condition.constant is not None:
            self._write_block(statement.body if condition.constant else statement.orelse)
            return
        self._write_braces(f"if ({condition.text}) {{", statement.body)
        rest: Sequence[ast.stmt] = statement.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If) and not self._begins(rest[0]):
            branch = rest[0]
            condition = converted(self.value_of(branch.test), BOOL)
            if condition.constant is not None:
                break
            self._write_braces(f"}} else if ({condition.text}) {{", branch.body)
            rest = branch.orelse
        if rest:
            self._write_braces("} else {", rest)
        self._emit("}")

    def _begins(self, statement: ast.stmt) -> bool:
        """Return whether a variable has to be declared before a statement."""
        homes = chain.from_iterable(self._homes.values())
        return any(home.statement is statement for home in homes)

    def _write_for(self, statement: ast.For) -> None:
        """Write a loop over a range, or each turn of one over a tuple or over a single row."""
        target = statement.target
        if not isinstance(target, ast.Name):
            raise NoCError("a loop of several variables")
        match statement.iter:
            case ast.Call(func=ast.Name(id="range"), args=[*arguments]):
                numbers = [self.value_of(argument) for argument in arguments]
            case ast.Tuple(elts=parts):
                for value in map(self.value_of, parts):
                    self._variables[target.id] = value
                    self._write_block(statement.body)
                return
            case _:
                raise NoCError(f"a loop over {ast.unparse(statement.iter)}")
        if len(numbers) > 2:
            raise NoCError("a loop by steps")
        first, last = numbers if len(numbers) > 1 else [constant(0), *numbers]
        if (first.constant, last.constant) == (0, 1):
            self._variables[target.id] = constant(0)
            self._write_block(statement.body)
            return
        name = target.id
        self._variables[name] = Value(name, INT)
        self._kinds[name] = INT
        head = f"for (int32_t {name} = {first.text}; {name} < {last.text}; {name}++) {{"
        self._write_braces(head, statement.body)
        self._emit("}")

    def _write_return(self, node: ast.expr | None) -> None:
        if node is None:
            self._emit("return;")
            return
        value = self.value_of(node)
        if self._returned is None:
            self._returned = REAL if value.kind is DOUBLE else value.kind
        self._emit(f"return {converted(value, self._returned).text};")

    def _assign(self, target: ast.expr, node: ast.expr) -> None:
        match node:
            case ast.Call(func=ast.Attribute(attr="empty"), args=[shape, _]):
                self._assign_array(target, shape)
                return
        value = self.evaluate(node)
        if isinstance(value, Known) and value.is_fixed and isinstance(target, ast.Name):
            self._variables[target.id] = value
            return
        value = value if isinstance(value, Value) else self._as_value(value)
        if isinstance(target, ast.Tuple):
            self._unpack(target.elts, value)
        else:
            self._assign_value(target, value)

    def _assign_array(self, target: ast.expr, shape: ast.expr) -> None:
        """Declare an array of a constant number of floats."""
        lengths = self.value_of(shape)
        numbers = tuple(part.constant for part in lengths.parts or (lengths,))
        if not isinstance(target, ast.Name) or None in numbers:
            raise NoCError("an array whose length is not constant")
        kind = ArrayOf(FLOAT, numbers)
        self._kinds[target.id] = kind
        self._variables[target.id] = Value(target.id, kind, root=target.id)
        self._emit(f"float {target.id}[{int(np.prod(numbers))}];")

    def _unpack(self, targets: Sequence[ast.expr], value: Value) -> None:
        if isinstance(value.kind, ArrayOf):
            length = value.kind.shape[0]
            parts = [Value(f"{value.text}[{n}]", value.kind.element) for n in range(length)]
        elif value.parts is not None:
            parts = list(value.parts)
            for number, target in enumerate(targets):
                later = " ".join(part.text for part in parts[number + 1 :])
                if re.search(rf"\b{re.escape(self._target_text(target))}(?!\w)", later):
                    raise NoCError("an exchange of values")
        else:
            kind = value.kind
            assert isinstance(kind, TupleOf)
            name = value.text
            if not name.isidentifier():
                self._n_results += 1
                name = f"result_{self._n_results}"
                self._emit(f"const {kind.name} {name} = {value.text};")
            parts = [Value(f"{name}.at[{n}]", kind.element) for n in range(kind.length)]
        for target, part in zip(targets, parts, strict=True):
            self._assign_value(target, part)

    def _target_text(self, target: ast.expr) -> str:
        if isinstance(target, ast.Subscript):
            item = self.item_of(target)
            assert isinstance(item, Value)
            return item.text
        return ast.unparse(target)

    def _assign_value(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Subscript):
            self._assign_item(target, value)
            return
        if not isinstance(target, ast.Name):
            raise NoCError(f"an assignment to {ast.unparse(target)}")
        name = target.id
        if name not in self._reads:
            return
        if isinstance(value.kind, ArrayOf):
            self._variables[name] = Value(name, value.kind, root=value.root)
            element = value.kind.element.name
            self._emit(f"<const {value.root}>{element} *{name} = {value.text};")
            return
        is_declared = any(
            home.statement is self._statement and home.is_declared_there
            for home in self._homes.get(name, ())
        )
        if is_declared or name not in self._kinds:
            self._kinds[name] = self._kind_of(name, value.kind)
            self._variables[name] = Value(name, self._kinds[name])
        text = self._as_kind_of(name, value).text
        self._used.add(name)
        self._emit(f"{declared(name, self._kinds[name]) if is_declared else name} = {text};")

    def _kind_of(self, name: str, kind: Kind) -> Kind:
        return REAL if kind is FLOAT and name in self._wide else kind

    def _as_kind_of(self, name: str, value: Value) -> Value:
        """Return a value as one of a variable's kind, which may have to be another one."""
        if self._kinds[name] is FLOAT and value.kind is REAL:
            self._wide.add(name)
            return stored(value, FLOAT)
        return converted(value, self._kinds[name])

    def _assign_item(self, target: ast.Subscript, value: Value) -> None:
        """Write to an element, or to all elements of a slice."""
        item = self.item_of(target)
        assert isinstance(item, Value)
        self._written.add(item.root)
        if isinstance(item.kind, ArrayOf):
            text = stored(value, item.kind.element).text
            index = "n"
            while index in self._variables:  # which the value may use
                index += "n"
            length = item.kind.shape[0]
            self._emit(f"for (int32_t {index} = 0; {index} < {length}; {index}++) {{")
            self._emit(f"{INDENT}{item.within(ATOM)}[{index}] = {text};")
            self._emit("}")
            return
        self._emit(f"{item.text} = {stored(value, item.kind).text};")

    def _change(self, statement: ast.AugAssign) -> None:
        """Write `a = a + b` for `a += b`: C would convert by other rules."""
        value = self.value_of(statement.value)
        target: Value | Known = self.value_of(statement.target)
        if isinstance(statement.target, ast.Subscript):
            target = self.item_of(statement.target)
        assert isinstance(target, Value)
        if isinstance(target.kind, ArrayOf):
            if target.kind.shape != (1,):
                raise NoCError(f"a change of all of {target.text}")
            self._written.add(target.root)
            target = Value(f"{target.text}[0]", target.kind.element, root=target.root)
        if isinstance(statement.target, ast.Subscript):
            self._written.add(target.root)
        sign = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*="}.get(type(statement.op), "=")
        if sign == "=":
            value = self.operation(statement.op, target, value)
        if target.text in self._kinds:
            value = self._as_kind_of(target.text, value)
        else:
            value = stored(value, target.kind)
        self._emit(f"{target.text} {sign} {value.text};")
