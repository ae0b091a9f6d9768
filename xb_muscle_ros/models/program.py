"""Expressions as straight-line programs: shared terms once, derivatives by the chain rule, printed in Python.

Differentiating the program line by line keeps the exponentials that a rate and its derivatives share; differentiating
the written-out expressions would lose them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import sympy
from sympy.printing.pycode import PythonCodePrinter
from sympy.simplify.cse_opts import sub_post

from xb_muscle_ros.models.factoring import Factors, replaced, signed
from xb_muscle_ros.symbolic.symbols import CALLS

Line = tuple[Any, Any]


class Program:
    """Lines ``symbol = expression`` in order, and the results that they lead to."""

    def __init__(self, lines: Sequence[Line], results: Sequence[Any]) -> None:
        self.lines = list(lines)
        self.results = list(results)

    def substituted(self, values: Mapping[Any, Any]) -> Program:
        """The same program with symbols replaced; lines that become plain numbers or symbols are folded away."""
        known = dict(values)
        lines: list[Line] = []
        for symbol, expression in self.lines:
            new = replaced(expression, known)
            if new.is_Atom:
                known[symbol] = new
            else:
                lines.append((symbol, new))
        return Program(lines, [replaced(r, known) for r in self.results])

    def needed(self) -> Program:
        """The same program without the lines that no result uses."""
        wanted = set().union(*(r.free_symbols for r in self.results)) if self.results else set()
        kept: list[Line] = []
        for symbol, expression in reversed(self.lines):
            if symbol in wanted:
                kept.append((symbol, expression))
                wanted |= expression.free_symbols
        return Program(kept[::-1], self.results)


def program(expressions: Sequence[Any], prefix: str) -> Program:
    """Share the common terms of some expressions; new symbols are called prefix0, prefix1, ...

    Every call of a function gets a line of its own, so that its derivative can name it instead of calling it again.
    """
    numbers = sympy.numbered_symbols(prefix, real=True)
    # What SymPy calls "basic" optimizations, by functions that do not look at a shared subexpression again and again.
    basic = [(signed, sub_post), (Factors().factored, None)]
    shared, results = sympy.cse(list(expressions), symbols=numbers, order="none", optimizations=basic)
    lines: list[Line] = []
    names: dict[Any, Any] = {}

    def hoisted(expression: Any) -> Any:
        if not expression.args:
            return expression
        new = expression.func(*(hoisted(a) for a in expression.args))
        if not isinstance(new, sympy.Function):
            return new
        if new not in names:
            names[new] = next(numbers)
            lines.append((names[new], new))
        return names[new]

    for symbol, expression in shared:
        new = hoisted(expression)
        lines.append((symbol, new))
    return Program(lines, [hoisted(r) for r in results])


def jacobian(of: Program, variables: Sequence[Any], prefix: str) -> tuple[Program, list[list[Any]]]:
    """Extend a program by the derivatives of its results with respect to some variables.

    Returns:
        the extended program, whose results are those of `of`, and the rows of the Jacobian, as symbols or numbers.
    """
    numbers = sympy.numbered_symbols(prefix, real=True)
    tangents: dict[Any, dict[Any, Any]] = {v: {v: sympy.Integer(1)} for v in variables}
    lines: list[Line] = []

    def tangent(expression: Any, own: Any = None) -> dict[Any, Any]:
        """Derivatives of an expression by variable, partial derivatives kept on lines of their own."""
        found: dict[Any, Any] = {}
        for symbol in sorted(expression.free_symbols, key=str):
            if symbol not in tangents or not tangents[symbol]:
                continue
            partial = sympy.diff(expression, symbol)
            if own is not None and isinstance(expression, sympy.Function):
                partial = partial.xreplace({expression: own})
            if partial == 0:
                continue
            if not partial.is_Atom:
                name = next(numbers)
                lines.append((name, partial))
                partial = name
            for variable, slope in tangents[symbol].items():
                found[variable] = found.get(variable, 0) + partial * slope
        return found

    def named(slopes: dict[Any, Any]) -> dict[Any, Any]:
        for variable, slope in slopes.items():
            if not slope.is_Atom:
                name = next(numbers)
                lines.append((name, slope))
                slopes[variable] = name
        return {v: s for v, s in slopes.items() if s != 0}

    for symbol, expression in of.lines:
        lines.append((symbol, expression))
        tangents[symbol] = named(tangent(expression, symbol))
    rows = []
    for result in of.results:
        slopes = named(tangent(result))
        rows.append([slopes.get(v, sympy.Integer(0)) for v in variables])
    return Program(lines, of.results), rows


class OwnCalls:
    """Functions of `intrinsics` by name, and small whole powers as products, whatever the language.

    Mixed into SymPy's printers, which have what is missing here; SymPy has no types to say so.
    """

    def _print_Function(self, expr: Any) -> str:
        name = type(expr).__name__
        if name in CALLS:
            return f"{CALLS[name]}({', '.join(self._print(a) for a in expr.args)})"  # type: ignore[attr-defined]
        return str(super()._print_Function(expr))  # type: ignore[misc]

    def _print_Pow(self, expr: Any, **how: Any) -> str:
        return _power(self, expr) or str(super()._print_Pow(expr, **how))  # type: ignore[misc]


class _Python(OwnCalls, PythonCodePrinter):
    """Numba code: scalar functions from `math` and `intrinsics`."""


def _power(printer: Any, expr: Any) -> str | None:
    """Small whole powers as products: a call of pow costs more than the rest of a line."""
    base, exponent = expr.args
    if exponent.is_Integer and 1 <= abs(int(exponent)) <= 4:
        text = "*".join([f"({printer._print(base)})"] * abs(int(exponent)))
        return f"(1.0/({text}))" if int(exponent) < 0 else f"({text})"
    return None


_PYTHON = _Python({"fully_qualified_modules": True})


def python(expression: Any) -> str:
    """An expression as Python that Numba compiles."""
    return str(_PYTHON.doprint(expression.evalf() if expression.is_Rational else expression))
