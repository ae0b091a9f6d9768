"""A model's right-hand side in C: the same operations in the same order, for comparison."""

from __future__ import annotations

from typing import Any

from sympy.printing.c import C99CodePrinter

from xb_muscle_ros.models.codegen import all_rates, moving
from xb_muscle_ros.models.composition import Model
from xb_muscle_ros.models.program import OwnCalls, program


class _Printer(OwnCalls, C99CodePrinter):
    """C code with the functions of `_INTRINSICS`."""


_PRINTER = _Printer()


def _c(expression: Any) -> str:
    return str(_PRINTER.doprint(expression.evalf() if expression.is_Rational else expression))


def c_text(model: Model, smooth: bool) -> str:
    """C99 with ``void rhs(const double *z, double velocity, double calcium, const double *p, double *out)``."""
    e = model.equations(smooth)
    body = program(all_rates(e), "t")
    lines = [f"double {p.name} = p[{i}];" for i, p in enumerate(e.parameters)]
    lines += [f"double {name} = z[{i}];" for i, name in enumerate([*(s.name for s in e.states), *moving(e)])]
    lines += [f"double {symbol} = {_c(expression)};" for symbol, expression in body.lines]
    lines += [f"out[{i}] = {_c(result)};" for i, result in enumerate(body.results)]
    text = "\n    ".join(lines)
    head = "void rhs(const double *restrict z, double velocity, double calcium, const double *restrict p,"
    return f"#include <math.h>\n{_INTRINSICS}\n{head} double *restrict out) {{\n    {text}\n}}\n"


_INTRINSICS = """
static inline double decay(double z, double k) {
    double kz = k * z;
    return kz > 36.8 ? 0.0 : exp(-fabs(kz));
}
static inline double logistic(double z, double k, double t) { return (z > 0.0 ? 1.0 : t) / (1.0 + t); }
static inline double softplus(double z, double k, double t) {
    double above = z > 0.0 ? z : 0.0;
    if (t < 1e-8) return above + t * (1.0 - 0.5 * t) / k;
    return above + log1p(t) / k;
}
static inline double unit_step(double z) { return z > 0.0 ? 1.0 : 0.0; }
static inline double positive_part(double z) { return z < 0.0 ? 0.0 : z; }
static inline double tangent_sinh(double z) {
    if (z > 12.0) return sinh(12.0) + cosh(12.0) * (z - 12.0);
    if (z < -12.0) return -sinh(12.0) + cosh(12.0) * (z + 12.0);
    return sinh(z);
}
static inline double tangent_cosh(double z) { return cosh(fmin(fabs(z), 12.0)); }
static inline double deviation(double v) {
    double root = sqrt(v * v + 4e-12);
    return v < 0.0 ? sqrt(2e-12 / (root - v)) : sqrt(0.5 * (v + root));
}
static inline double hyperbolic_tangent(double z) { return 1.0 - 2.0 / (exp(2.0 * z) + 1.0); }
static inline double limited(double z) {
    return z < 12.0 ? z : 12.0 + 3.0 * hyperbolic_tangent((z - 12.0) / 3.0);
}
static inline double limited_slope(double z) {
    double t = hyperbolic_tangent((z - 12.0) / 3.0);
    return z < 12.0 ? 1.0 : 1.0 - t * t;
}
"""
