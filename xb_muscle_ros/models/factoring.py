"""Common factors of sums put in front as `sympy.factor_terms` puts them, but each distinct subexpression only once.

The expressions of a model are small as graphs and huge as trees: with every mechanism, 430 distinct subexpressions
occur 110 000 times. SymPy's own functions walk the tree; these remember what they have seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import sympy
from sympy.core.mul import _keep_coeff


def replaced(expression: Any, rules: Mapping[Any, Any]) -> Any:
    """Replace subexpressions, the outermost that has a rule first; what a rule puts in stays as it is.

    Args:
        expression: any SymPy expression.
        rules: new subexpressions by old ones.
    """
    known: dict[Any, tuple[Any, bool]] = {}

    def walk(node: Any) -> tuple[Any, bool]:
        """The new node, and whether anything within was replaced: what is put in may be what was there."""
        if node in rules:
            return rules[node], True
        if not node.args:
            return node, False
        if node not in known:
            parts = [walk(part) for part in node.args]
            changed = any(touched for _, touched in parts)
            known[node] = (node.func(*(new for new, _ in parts)) if changed else node), changed
        return known[node]

    return walk(expression)[0]


def sums(expression: Any) -> set[Any]:
    """All sums within an expression."""
    seen: set[Any] = set()
    left = [expression]
    while left:
        node = left.pop()
        if node.args and node not in seen:
            seen.add(node)
            left += node.args
    return {node for node in seen if node.is_Add}


def signed(expression: Any) -> Any:
    """Write each sum with more minus than plus signs as minus its opposite, so that both share one subexpression.

    As SymPy's `sub_pre` does: a sum of this kind that only comes about by these changes is marked by a factor 1, which
    its `sub_post` takes away.
    """
    opposite = {s: -s for s in sums(expression) if s.could_extract_minus_sign()}
    rules = {s: sympy.Mul._from_args([sympy.S.NegativeOne, o]) for s, o in opposite.items() if not o.is_Mul}
    expression = replaced(expression, rules)
    again = {}
    for s in sums(expression):
        if s in rules:
            again[s] = rules[s]
        elif s not in opposite and s.could_extract_minus_sign():
            again[s] = sympy.Mul._from_args([sympy.S.One, sympy.S.NegativeOne, -s])
    return replaced(expression, again)


class Factors:
    """Sums with their common factors in front; remembers every subexpression that it was given."""

    def __init__(self) -> None:
        self._factored: dict[Any, Any] = {}
        self._contents: dict[Any, tuple[Any, Any]] = {}

    def factored(self, expression: Any) -> Any:
        """The same expression, factors common to the terms of a sum in front, everywhere."""
        if not expression.args:
            return expression
        if expression not in self._factored:
            self._factored[expression] = self._factor(expression)
        return self._factored[expression]

    def _factor(self, expression: Any) -> Any:
        if expression.is_Pow or expression.is_Function:
            parts = tuple(self.factored(part) for part in expression.args)
            return expression if parts == expression.args else expression.func(*parts)
        number, rest = self._content(expression)
        if rest.is_Add:
            terms = [self.factored(term) for term in rest.args]
            if all(term.as_coeff_Mul()[0].is_extended_negative for term in terms):
                number, terms = -number, [-term for term in terms]
            # An exponent -(a + b) would come back as -a - b, and hide that exp(a + b) is there already.
            kept = {}
            for i, term in enumerate(terms):
                exponent = term.as_base_exp()[1]
                if exponent.is_Mul and exponent != sympy.Mul(*exponent.args):
                    terms[i] = sympy.Dummy()
                    kept[terms[i]] = term
            rest = sympy.gcd_terms(sympy.Add._from_args(terms), isprimitive=True, clear=False, fraction=False)
            rest = replaced(rest, kept) if kept else rest
        elif rest.args:
            rest = rest.func(*(self.factored(part) for part in rest.args))
        return _keep_coeff(number, rest, clear=False, sign=True)

    def _content(self, expression: Any) -> tuple[Any, Any]:
        """A positive rational number and what is left of the expression without it."""
        if expression not in self._contents:
            self._contents[expression] = self._divided(expression)
        return self._contents[expression]

    def _divided(self, expression: Any) -> tuple[Any, Any]:
        if expression.is_Add:
            terms = [_keep_coeff(*self._content(term)) for term in expression.args]
            number, rest = expression.func(*terms).primitive()
            if not number.is_Integer and rest.is_Add:
                # x/2 + 1 stays what it is: (x + 2)/2 is no shorter.
                number, below = number.as_numer_denom()
                over = rest / below
                if any(term.as_coeff_Mul()[0].is_Integer for term in over.args):
                    return number, over
                number /= below
            return number, rest
        if expression.is_Mul:
            number, parts = sympy.S.One, []
            for factor in expression.args:
                of_factor, part = self._content(factor)
                number *= of_factor
                if part is not sympy.S.One:
                    parts.append(part)
            return number, expression.func(*parts)
        if expression.is_Pow and expression.exp.is_Rational and self._content(expression.base) == (1, expression.base):
            return sympy.S.One, expression
        return tuple(expression.as_content_primitive(radical=False, clear=False))
