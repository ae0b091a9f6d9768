"""Functions that a mechanism's formulas may use beside + - * / and **.

Every function takes floats or the symbols that the composition hands to a mechanism. With floats it computes, so that
a formula can be tried and tested as plain Python; with symbols it builds the expression that is differentiated and
compiled. SymPy is imported on the first symbol only: a node with compiled models never loads it.
"""

from __future__ import annotations

import math
from typing import Any

# A symbol, an expression or a float. SymPy has no types, and formulas must not care which of them they hold.
Expr = Any


def _numeric(*values: Expr) -> bool:
    return all(isinstance(value, (int, float)) for value in values)


def exp(z: Expr) -> Expr:
    """E to the power z."""
    if _numeric(z):
        return math.exp(z)
    import sympy

    return sympy.exp(z)


def log(z: Expr) -> Expr:
    """Natural logarithm."""
    if _numeric(z):
        return math.log(z)
    import sympy

    return sympy.log(z)


def sqrt(z: Expr) -> Expr:
    """Square root."""
    if _numeric(z):
        return math.sqrt(z)
    import sympy

    return sympy.sqrt(z)


def tanh(z: Expr) -> Expr:
    """Hyperbolic tangent."""
    if _numeric(z):
        return math.tanh(z)
    from xb_muscle_ros.symbolic.symbols import HyperbolicTangent

    return HyperbolicTangent(z)


def erf(z: Expr) -> Expr:
    """Error function."""
    if _numeric(z):
        return math.erf(z)
    import sympy

    return sympy.erf(z)


def asinh(z: Expr) -> Expr:
    """Inverse hyperbolic sine, ln(z + sqrt(z² + 1))."""
    if _numeric(z):
        return math.asinh(z)
    import sympy

    return sympy.asinh(z)


def tangent_sinh(z: Expr) -> Expr:
    """Hyperbolic sine up to |z| = 12, its tangent there beyond."""
    if _numeric(z):
        from xb_muscle_ros.symbolic.intrinsics import tangent_sinh as compute

        return float(compute(z))
    from xb_muscle_ros.symbolic.symbols import TangentSinh

    return TangentSinh(z)


def limited(z: Expr) -> Expr:
    """Z up to 12, levelling off at 15 beyond."""
    if _numeric(z):
        from xb_muscle_ros.symbolic.intrinsics import limited as compute

        return float(compute(z))
    from xb_muscle_ros.symbolic.symbols import Limited

    return Limited(z)


def deviation(variance: Expr) -> Expr:
    """Standard deviation of a variance that numerical error may have carried to zero or below.

    The root of (v + sqrt(v² + 4e-12))/2: sqrt(v) to six digits from v = 1e-3 on, 1e-3 at zero, and still smooth and
    positive, but vanishing, below.
    """
    if _numeric(variance):
        from xb_muscle_ros.symbolic.intrinsics import deviation as compute

        return float(compute(variance))
    from xb_muscle_ros.symbolic.symbols import Deviation

    return Deviation(variance)


def softplus(z: Expr, sharpness: Expr) -> Expr:
    """Smooth positive part ln(1 + exp(sharpness z))/sharpness, in the unit of z."""
    if _numeric(z, sharpness):
        return max(z, 0.0) + math.log1p(math.exp(-abs(sharpness * z))) / sharpness
    from xb_muscle_ros.symbolic.symbols import Decay, Softplus

    return Softplus(z, sharpness, Decay(z, sharpness))


def positive(z: Expr) -> Expr:
    """Positive part of z, 0 below 0."""
    if _numeric(z):
        return max(z, 0.0)
    from xb_muscle_ros.symbolic.symbols import Positive

    return Positive(z)


def above(z: Expr) -> Expr:
    """1 where z > 0, else 0."""
    if _numeric(z):
        return 1.0 if z > 0.0 else 0.0
    from xb_muscle_ros.symbolic.symbols import UnitStep

    return UnitStep(z)


def smooth_series_extension(force: Expr, kse0: Expr, sharpness: Expr) -> Expr:
    """Integral of dF/(softplus(F, sharpness) + kse0) from 0 to force: extension times kse of the smoothed spring."""
    if _numeric(force, kse0, sharpness):
        from xb_muscle_ros.symbolic.intrinsics import smooth_series_extension as compute

        return float(compute(force, kse0, sharpness))
    from xb_muscle_ros.symbolic.symbols import SmoothSeriesExtension

    return SmoothSeriesExtension(force, kse0, sharpness)
