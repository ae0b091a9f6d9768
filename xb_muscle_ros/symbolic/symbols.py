"""SymPy functions whose derivatives and compiled forms are our own: see `intrinsics` for what they compute."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy

CALLS: dict[str, str] = {}
"""Printed as calls of these functions of `intrinsics`, in Python and in C alike: by the name of the SymPy function."""


def _function(name: str, call: str, arguments: int, slopes: Callable[..., tuple[Any, ...]] | None = None) -> Any:
    """A SymPy function.

    Args:
        name: of its class.
        call: name of the function of `intrinsics` that computes it.
        arguments: how many it has.
        slopes: from the function and its arguments, derivatives by the first of these; None: it is never
            differentiated.
    """
    members: dict[str, Any] = {"nargs": arguments, "__module__": __name__}
    if slopes is not None:
        members["fdiff"] = lambda self, argindex=1: slopes(self, *self.args)[argindex - 1]
    CALLS[name] = call
    return type(name, (sympy.Function,), members)


_NONE = sympy.Integer(0)

# Two arguments rather than their product, which SymPy would flatten into z's own factors: the same exponential would
# then go under two names.
Decay = _function("Decay", "decay", 2)
"""exp(-|k z|), arguments z and k: what softplus and its derivative share."""
Logistic = _function("Logistic", "logistic", 3, lambda f, z, k, _: (k * f * (1 - f), z * f * (1 - f), _NONE))
"""1/(1 + exp(-k z)); arguments z, k and exp(-|k z|), which was computed before and follows the others."""
Softplus = _function(
    "Softplus", "softplus", 3, lambda f, z, k, t: (Logistic(z, k, t), (z * Logistic(z, k, t) - f) / k, _NONE)
)
"""ln(1 + exp(k z))/k; arguments z, k and exp(-|k z|), which was computed before and follows the others."""
UnitStep = _function("UnitStep", "unit_step", 1, lambda *_: (_NONE,))
"""1 where z > 0, else 0; its derivative is 0 but at the step itself."""
Positive = _function("Positive", "positive_part", 1, lambda _, z: (UnitStep(z),))
"""max(z, 0); at the kink the derivative is that from below."""
HyperbolicTangent = _function("HyperbolicTangent", "hyperbolic_tangent", 1, lambda f, _: (1 - f**2,))
"""tanh(z). SymPy's own asks at every turn whether its argument is real, which took a quarter of the time."""
TangentCosh = _function("TangentCosh", "tangent_cosh", 1)
"""cosh(z) up to |z| = 12, constant beyond: the derivative of `TangentSinh`."""
TangentSinh = _function("TangentSinh", "tangent_sinh", 1, lambda _, z: (TangentCosh(z),))
"""sinh(z) up to |z| = 12, its tangent there beyond."""
LimitedSlope = _function("LimitedSlope", "limited_slope", 1)
"""Derivative of `Limited`."""
Limited = _function("Limited", "limited", 1, lambda _, z: (LimitedSlope(z),))
"""Z up to 12, levelling off at 15 beyond: see `ops.limited`."""
Deviation = _function("Deviation", "deviation", 1, lambda f, v: (f / (2 * sympy.sqrt(v**2 + 4e-12)),))
"""sqrt((v + sqrt(v² + 4e-12))/2): see `ops.deviation`."""
# Steps move states alone, so that c and k, which are parameters, need no derivative.
SmoothSeriesExtension = _function(
    "SmoothSeriesExtension",
    "smooth_series_extension",
    3,
    lambda _, force, c, k: (1 / (Softplus(force, k, Decay(force, k)) + c),),
)
"""Integral of dF/(Softplus(F, k) + c) from 0 to F; arguments F, c, k; its derivative by F is the integrand."""
