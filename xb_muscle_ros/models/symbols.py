"""SymPy functions whose derivatives and compiled forms are our own: see `intrinsics` for what they compute."""

from __future__ import annotations

from typing import Any

import sympy


class Decay(sympy.Function):
    """exp(-|z|): what softplus and its derivative share."""

    nargs = 1


class Logistic(sympy.Function):
    """1/(1 + exp(-z)); arguments z and exp(-|z|), which was computed before."""

    nargs = 2

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz; the second argument follows the first."""
        return self * (1 - self) if argindex == 1 else sympy.Integer(0)


class Softplus(sympy.Function):
    """ln(1 + exp(k z))/k; arguments z, k and exp(-|k z|), which was computed before."""

    nargs = 3

    def fdiff(self, argindex: int = 1) -> Any:
        """d/dz or d/dk; the third argument follows the others."""
        z, k, decay = self.args
        if argindex == 1:
            return Logistic(k * z, decay)
        if argindex == 2:
            return (z * Logistic(k * z, decay) - self) / k
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


# Printed as calls of these names, in Python and in C alike.
CALLS = {
    "Decay": "decay",
    "Logistic": "logistic",
    "Softplus": "softplus",
    "UnitStep": "unit_step",
    "Positive": "positive_part",
    "tanh": "hyperbolic_tangent",
}


class SmoothSeriesExtension(sympy.Function):
    """Integral of dF/(Softplus(F, k) + c) from 0 to F; arguments F, c, k. Used in outputs, never differentiated."""

    nargs = 3


CALLS["SmoothSeriesExtension"] = "smooth_series_extension"
