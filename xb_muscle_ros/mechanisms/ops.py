"""Functions that a mechanism's formulas may use beside + - * / and **.

Every function takes floats or the symbols that the composition hands to a mechanism. With floats it computes, so that
a formula can be tried and tested as plain Python; with symbols it builds the expression that is differentiated and
compiled. SymPy is imported on the first symbol only: a node with compiled models never loads it.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

# A symbol, an expression or a float. SymPy has no types, and formulas must not care which of them they hold.
Expr = Any


def _numeric(*values: Expr) -> bool:
    return all(isinstance(value, (int, float)) for value in values)


def _called(function: str, *values: Expr) -> Expr:
    """What a function returns that is imported only now."""
    module, _, name = function.rpartition(".")
    found = getattr(importlib.import_module(module), name)
    # Of what Numba would compile for one call, the Python that it was written in.
    return getattr(found, "py_func", found)(*values)


def _own(name: str, *values: Expr) -> Expr:
    return _called(f"xb_muscle_ros.symbolic.symbols.{name}", *values)


def _function(of_floats: str, of_symbols: str) -> Callable[..., Expr]:
    """The function that two others are, one for floats and one for symbols."""
    return lambda *values: _called(of_floats if _numeric(*values) else of_symbols, *values)


_FLOATS, _SYMBOLS = "xb_muscle_ros.symbolic.intrinsics", "xb_muscle_ros.symbolic.symbols"

exp = _function("math.exp", "sympy.exp")
"""E to the power z."""
log = _function("math.log", "sympy.log")
"""Natural logarithm."""
sqrt = _function("math.sqrt", "sympy.sqrt")
"""Square root."""
tanh = _function("math.tanh", f"{_SYMBOLS}.HyperbolicTangent")
"""Hyperbolic tangent."""
erf = _function("math.erf", "sympy.erf")
"""Error function."""
asinh = _function("math.asinh", "sympy.asinh")
"""Inverse hyperbolic sine, ln(z + sqrt(z² + 1))."""
tangent_sinh = _function(f"{_FLOATS}.tangent_sinh", f"{_SYMBOLS}.TangentSinh")
"""Hyperbolic sine up to |z| = 12, its tangent there beyond."""
limited = _function(f"{_FLOATS}.limited", f"{_SYMBOLS}.Limited")
"""Z up to 12, levelling off at 15 beyond."""
deviation = _function(f"{_FLOATS}.deviation", f"{_SYMBOLS}.Deviation")
"""Standard deviation of a variance that numerical error may have carried to zero or below.

The root of (v + sqrt(v² + 4e-12))/2: sqrt(v) to six digits from v = 1e-3 on, 1e-3 at zero, and still smooth and
positive, but vanishing, below.
"""
smooth_series_extension = _function(f"{_FLOATS}.smooth_series_extension", f"{_SYMBOLS}.SmoothSeriesExtension")
"""Integral of dF/(softplus(F, sharpness) + kse0) from 0 to force: extension times kse of the smoothed spring.

Arguments: force, kse0, sharpness.
"""


def softplus(z: Expr, sharpness: Expr) -> Expr:
    """Smooth positive part ln(1 + exp(sharpness z))/sharpness, in the unit of z."""
    if _numeric(z, sharpness):
        return max(z, 0.0) + math.log1p(math.exp(-abs(sharpness * z))) / sharpness
    return _own("Softplus", z, sharpness, _own("Decay", z, sharpness))


def positive(z: Expr) -> Expr:
    """Positive part of z, 0 below 0; of an array that of each entry."""
    if isinstance(z, np.ndarray):
        return np.maximum(z, 0.0)
    return max(z, 0.0) if _numeric(z) else _own("Positive", z)


def above(z: Expr) -> Expr:
    """1 where z > 0, else 0; of an array that of each entry."""
    if isinstance(z, np.ndarray):
        return (z > 0.0).astype(float)
    return float(z > 0.0) if _numeric(z) else _own("UnitStep", z)
