"""SymPy functions whose derivatives and compiled forms are our own: see `intrinsics` for what they compute."""

from __future__ import annotations

from typing import Any

import sympy
from sympy.core.function import ArgumentIndexError


class Decay(sympy.Function):
    """exp(-|k z|), arguments z and k: what softplus and its derivative share.

    Two arguments rather than their product, which SymPy would flatten into z's own factors: the same exponential would
    then go under two names.
    """

    nargs = 2


class Logistic(sympy.Function):
    """1/(1 + exp(-k z)); arguments z, k and exp(-|k z|), which was computed before."""

    nargs = 3

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz or d/dk; the third argument follows the others."""
        z, k, _ = self.args
        return (k, z, sympy.Integer(0))[argindex - 1] * self * (1 - self)


class Softplus(sympy.Function):
    """ln(1 + exp(k z))/k; arguments z, k and exp(-|k z|), which was computed before."""

    nargs = 3

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz or d/dk; the third argument follows the others."""
        z, k, decay = self.args
        if argindex == 1:
            return Logistic(z, k, decay)
        if argindex == 2:
            return (z * Logistic(z, k, decay) - self) / k
        return sympy.Integer(0)


class UnitStep(sympy.Function):
    """1 where z > 0, else 0."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """Zero but at the step itself."""
        return sympy.Integer(0)


class Positive(sympy.Function):
    """max(z, 0)."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz; at the kink the derivative from below."""
        return UnitStep(self.args[0])


class HyperbolicTangent(sympy.Function):
    """tanh(z). SymPy's own asks at every turn whether its argument is real, which took a quarter of the time."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz."""
        return 1 - self**2


class TangentCosh(sympy.Function):
    """cosh(z) up to |z| = 12, constant beyond: the derivative of `TangentSinh`. Never differentiated itself."""

    nargs = 1


class TangentSinh(sympy.Function):
    """sinh(z) up to |z| = 12, its tangent there beyond."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz."""
        return TangentCosh(self.args[0])


class LimitedSlope(sympy.Function):
    """Derivative of `Limited`. Never differentiated itself."""

    nargs = 1


class Limited(sympy.Function):
    """Z up to 12, levelling off at 15 beyond: see `ops.limited`."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz."""
        return LimitedSlope(self.args[0])


class Deviation(sympy.Function):
    """sqrt((v + sqrt(v² + 4e-12))/2): see `ops.deviation`."""

    nargs = 1

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dv."""
        return self / (2 * sympy.sqrt(self.args[0] ** 2 + 4e-12))


class SmoothSeriesExtension(sympy.Function):
    """Integral of dF/(Softplus(F, k) + c) from 0 to F; arguments F, c, k."""

    nargs = 3

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dF: the integrand. Steps move states alone, so that c and k, which are parameters, need no derivative."""
        if argindex != 1:
            raise ArgumentIndexError(self, argindex)
        force, c, k = self.args
        return 1 / (Softplus(force, k, Decay(force, k)) + c)


# Printed as calls of these names, in Python and in C alike.
CALLS = {
    "Decay": "decay",
    "Logistic": "logistic",
    "Softplus": "softplus",
    "UnitStep": "unit_step",
    "Positive": "positive_part",
    "HyperbolicTangent": "hyperbolic_tangent",
    "TangentSinh": "tangent_sinh",
    "TangentCosh": "tangent_cosh",
    "Deviation": "deviation",
    "Limited": "limited",
    "LimitedSlope": "limited_slope",
    "SmoothSeriesExtension": "smooth_series_extension",
}
