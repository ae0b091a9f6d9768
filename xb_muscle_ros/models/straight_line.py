"""Straight-line functions compiled without inferring types: every local is a double, every line runs once.

Numba spends most of the compilation of a generated step on finding out that each of its thousands of locals is a float,
and on lowering them one by one. These functions are read as text and handed to LLVM directly, operation by operation in
the order in which they are written: results are those of Numba's own compilation, to the bit.

Such a function may contain: assignments to names and to entries of arrays, by constant index; + - * / ** and calls;
``a if x == y else b``; one ``return`` at the end, of a float or, where another such function calls it, of a tuple.
"""

from __future__ import annotations

import ast
import functools
import inspect
import operator
from collections.abc import Sequence
from pathlib import Path
from types import FunctionType
from typing import Any

from llvmlite import ir
from numba import float64, types
from numba.core import cgutils, typing
from numba.extending import intrinsic

_INSTRUCTIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_ON_NUMBERS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}


def straight_line(function: FunctionType) -> Any:
    """Make a straight-line function callable from code that Numba compiles; its source must be in a file.

    Arguments are numbers and arrays of numbers; the function returns a float or nothing.
    """

    def define(context: Any, *arguments: Any) -> Any:
        gives = float64 if isinstance(_definition(function).body[-1], ast.Return) else types.none
        takes = [a if isinstance(a, types.Array) else float64 for a in arguments]

        def generate(target: Any, builder: Any, signature: Any, values: Sequence[Any]) -> Any:
            views = _views(target, builder, signature, values)
            result = _Writer(target, builder, function).called(_definition(function), views)
            return target.get_dummy_value() if result is None else result

        return typing.signature(gives, *takes), generate

    define.__name__ = define.__qualname__ = function.__name__
    own = list(inspect.signature(function).parameters.values())
    first = inspect.Parameter("context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    define.__signature__ = inspect.Signature([first, *own])  # type: ignore[attr-defined]  # set, as functools does
    return intrinsic(define)


@functools.lru_cache(maxsize=4)
def _functions(file: str) -> dict[str, ast.FunctionDef]:
    """The functions of a module by name."""
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def _definition(function: FunctionType) -> ast.FunctionDef:
    return _functions(function.__code__.co_filename)[function.__name__]


class _View:
    """An array argument: entries by constant index."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self._context, self._builder, self._kind = context, builder, kind
        self._array = context.make_array(kind)(context, builder, value)
        self._shape = cgutils.unpack_tuple(builder, self._array.shape, kind.ndim)
        self._strides = cgutils.unpack_tuple(builder, self._array.strides, kind.ndim)

    def _pointer(self, index: int) -> Any:
        at = [self._context.get_constant(types.intp, index)]
        return cgutils.get_item_pointer2(
            self._context, self._builder, self._array.data, self._shape, self._strides, self._kind.layout, at
        )

    def load(self, index: int) -> Any:
        value = self._context.unpack_value(self._builder, self._kind.dtype, self._pointer(index))
        return self._context.cast(self._builder, value, self._kind.dtype, float64)

    def store(self, index: int, value: Any) -> None:
        value = self._context.cast(self._builder, value, float64, self._kind.dtype)
        self._context.pack_value(self._builder, self._kind.dtype, value, self._pointer(index))


def _views(context: Any, builder: Any, signature: Any, values: Sequence[Any]) -> list[Any]:
    pairs = zip(signature.args, values, strict=True)
    return [_View(context, builder, kind, v) if isinstance(kind, types.Array) else v for kind, v in pairs]


class _Writer:
    """Writes one function, and those of the same module that it calls, at the builder's place."""

    def __init__(self, context: Any, builder: Any, function: FunctionType) -> None:
        self._context, self._builder = context, builder
        self._globals = function.__globals__
        self._functions = _functions(function.__code__.co_filename)
        self._callees: dict[tuple[str, int], Any] = {}

    def called(self, definition: ast.FunctionDef, arguments: Sequence[Any]) -> Any:
        """What the function returns: a value, a list of values, or None."""
        values = dict(zip((a.arg for a in definition.args.args), arguments, strict=True))
        for line in definition.body:
            match line:
                case ast.Expr(value=ast.Constant()) | ast.Pass():
                    pass
                case ast.Assign(targets=[ast.Name(id=name)], value=expression):
                    values[name] = self._of(expression, values)
                case ast.Assign(targets=[ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=int() as i))]):
                    values[name].store(i, self._float(self._of(line.value, values)))
                case ast.Return(value=ast.Tuple(elts=parts)):
                    return [self._of(part, values) for part in parts]
                case ast.Return(value=expression) if expression is not None:
                    return self._float(self._of(expression, values))
                case _:
                    raise NotImplementedError(f"{definition.name}: '{ast.unparse(line)}' is not a straight line")
        return None

    def _float(self, value: Any) -> Any:
        return value if isinstance(value, ir.Value) else ir.Constant(ir.DoubleType(), float(value))

    def _of(self, expression: ast.expr, values: dict[str, Any]) -> Any:
        """A value of LLVM, or a number of Python where all that goes in is known."""
        match expression:
            case ast.Constant(value=int() | float() as number):
                return number
            case ast.Name(id=name):
                return values[name]
            case ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=int() as i)):
                whole = values[name]
                return whole[i] if isinstance(whole, list) else whole.load(i)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                value = self._of(operand, values)
                return self._builder.fneg(value) if isinstance(value, ir.Value) else -value
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self._call("**", operator.pow, [self._of(left, values), self._of(right, values)])
            case ast.BinOp(left=left, op=op, right=right):
                first, second = self._of(left, values), self._of(right, values)
                if not isinstance(first, ir.Value) and not isinstance(second, ir.Value):
                    return _ON_NUMBERS[type(op)](first, second)
                return getattr(self._builder, _INSTRUCTIONS[type(op)])(self._float(first), self._float(second))
            case ast.IfExp(test=ast.Compare(left=left, ops=[ast.Eq()], comparators=[right]), body=then, orelse=other):
                sides = [self._float(self._of(side, values)) for side in (left, right)]
                choices = [self._float(self._of(choice, values)) for choice in (then, other)]
                return self._builder.select(self._builder.fcmp_ordered("==", *sides), *choices)
            case ast.Call(func=ast.Name(id=name), args=parts) if name in self._functions:
                return self.called(self._functions[name], [self._of(part, values) for part in parts])
            case ast.Call(func=ast.Name(id="max"), args=[left, right]):
                # As Python has it: the second where it is greater, so that a NaN that comes second is passed over.
                first, second = (self._float(self._of(side, values)) for side in (left, right))
                return self._builder.select(self._builder.fcmp_ordered(">", second, first), second, first)
            case ast.Call(func=function, args=parts):
                name = ast.unparse(function)
                return self._call(name, self._known(function), [self._of(part, values) for part in parts])
            case ast.Attribute():
                return self._known(expression)
        raise NotImplementedError(f"'{ast.unparse(expression)}' has no place in a straight-line function")

    def _known(self, expression: ast.expr) -> Any:
        """What a name outside the function stands for."""
        match expression:
            case ast.Name(id=name):
                return self._globals[name] if name in self._globals else self._globals["__builtins__"][name]
            case ast.Attribute(value=whole, attr=name):
                return getattr(self._known(whole), name)
        raise NotImplementedError(f"'{ast.unparse(expression)}' is no name")

    def _call(self, name: str, callee: Any, arguments: Sequence[Any]) -> Any:
        """A call of anything that Numba can call, of floats."""
        if (name, len(arguments)) not in self._callees:
            kind = self._context.typing_context.resolve_value_type(callee)
            takes = (float64,) * len(arguments)
            signature = self._context.typing_context.resolve_function_type(kind, takes, {})
            self._callees[name, len(arguments)] = self._context.get_function(kind, signature)
        function = self._callees[name, len(arguments)]
        self._context.add_linking_libs(getattr(function, "libs", ()))
        return function(self._builder, [self._float(a) for a in arguments])
