"""Factoring that remembers against SymPy's own, which walks every path through an expression."""

from __future__ import annotations

import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from sympy.simplify.cse_opts import sub_pre

from xb_muscle_ros.models.factoring import Factors, replaced, signed, sums
from xb_muscle_ros.models.registry import compose

X, Y, Z = sympy.symbols("x y z", real=True)
_LEAVES = st.one_of(
    st.sampled_from([X, Y, Z, sympy.Float(0.25), sympy.Float(-1.5)]),
    st.integers(-4, 6).map(sympy.Integer),
    st.sampled_from([sympy.Rational(1, 2), sympy.Rational(-2, 3)]),
)


def _grown(parts: st.SearchStrategy[sympy.Expr]) -> st.SearchStrategy[sympy.Expr]:
    several = st.lists(parts, min_size=2, max_size=3)
    return st.one_of(
        several.map(lambda p: sympy.Add(*p)),
        several.map(lambda p: sympy.Mul(*p)),
        st.builds(lambda p, n: (1 + p**2) ** n, parts, st.sampled_from([-2, -1, 2, sympy.Rational(1, 2)])),
        parts.map(lambda p: sympy.exp(-(X + p))),
        parts.map(lambda p: -p),
    )


EXPRESSIONS = st.recursive(_LEAVES, _grown, max_leaves=12)


@given(expression=EXPRESSIONS)
def test_factors_are_those_of_sympy(expression: sympy.Expr) -> None:
    assert Factors().factored(expression) == sympy.factor_terms(expression)


@given(expression=EXPRESSIONS)
def test_signs_are_those_of_sympy(expression: sympy.Expr) -> None:
    assert signed(expression) == sub_pre(expression)


@given(expression=EXPRESSIONS, value=EXPRESSIONS)
def test_replacing_and_finding_are_those_of_sympy(expression: sympy.Expr, value: sympy.Expr) -> None:
    rules = {X: value, Y + Z: X}
    assert replaced(expression, rules) == expression.xreplace(rules)
    assert sums(expression) == expression.atoms(sympy.Add)


@pytest.mark.parametrize("model", ["3state_coop", "4state_coop_slack", "2state+nonlinear_crossbridge", "hill_se"])
def test_a_models_equations_are_factored_as_by_sympy(model: str) -> None:
    e = compose(model).equations(False)
    factors = Factors()
    for expression in (*e.derivatives, *e.outputs):
        assert factors.factored(signed(expression)) == sympy.factor_terms(sub_pre(expression))


@pytest.mark.slow
def test_shared_subexpressions_are_looked_at_once() -> None:
    """2⁶⁰ paths lead through this expression: what walks them all never ends."""
    expression = X
    for _ in range(60):
        expression = sympy.exp(expression) + sympy.sqrt(1 + expression)
    assert len(sums(expression)) == 120
    assert Factors().factored(signed(expression)) == expression
    assert replaced(expression, {X: Y}) != expression
