"""Gaussian form: the heads' strain is normally distributed, three moments tell all (Zahalak 1981)."""

from __future__ import annotations

import math

from xb_muscle_ros.distribution.base import MomentRepresentation
from xb_muscle_ros.mechanisms import ExponentialRate, Expr, Moments, Quantities, State, StepRate, StrainRate, ops

# Moments in power strokes: at 40 the fibre's end would have moved by 30 % L0 with the heads still attached.
_FAR = 40.0
# Where the released sets end the integral over heads that are torn off, power strokes.
_UPPER = 10.0


class Gaussian(MomentRepresentation):
    """Q0 times a normal density with mean p = Q1/Q0 and variance q = Q2/Q0 - p²."""

    name = "gaussian"
    # With few heads attached the smooth form divides by more than Q0: its own equations then carry Q2 below zero in
    # fast movements (its variance is a softplus of what comes out), so that there Q2 must be finite and no more.
    states = (
        State("q0", "1", "fraction of heads attached", 0.0, 1.0),
        State("q1", "power strokes", "first moment of the attached heads over strain", -_FAR, _FAR),
        State("q2", "power strokes²", "second moment of the attached heads over strain", 0.0, _FAR**2, 1.6e5),
    )

    def mean_and_variance(self, q: Quantities) -> tuple[Expr, Expr]:
        """P and q of the heads' strain."""
        heads = q.divisor(q.q0)
        mean = q.q1 / heads
        return mean, q.variance(q.q2 / heads - mean**2)

    def outflow(self, q: Quantities, rate: StrainRate) -> Moments:
        """Closed forms: an exponential tilts the normal density, a step truncates it."""
        mean, variance = self.mean_and_variance(q)
        if isinstance(rate, ExponentialRate):
            exponent = rate.slope * mean + rate.slope**2 * variance / 2
            flux = q.q0 * rate.scale * ops.exp(q.limit(exponent))
            shifted = mean + rate.slope * variance
            return Moments(flux, flux * shifted, flux * (shifted**2 + variance))
        if isinstance(rate, StepRate):
            return _above(q, rate, mean, variance)
        raise TypeError(f"the Gaussian form has no moments for a rate of type {type(rate).__name__}")


def _above(q: Quantities, rate: StepRate, mean: Expr, variance: Expr) -> Moments:
    """Moments of the heads above a threshold: a truncated normal density.

    The released sets put tanh in place of erf and end the integral at 10 power strokes; with smoothing so do we. The
    variance can be lost in rounding while next to no head is attached: see `ops.deviation`.
    """
    spread = ops.deviation(2 * variance)

    def parts(x: Expr) -> tuple[Expr, Expr]:
        z = (x - mean) / spread
        return (ops.tanh(z) if q.smooth else ops.erf(z)), ops.exp(-(z**2))

    below, bell = parts(rate.threshold)
    # At infinity erf is 1 and the bell 0.
    end, end_bell = parts(_UPPER) if q.smooth else (1, 0)
    flux = q.q0 * rate.height / 2
    share = end - below
    edge = spread / math.sqrt(math.pi)
    return Moments(
        flux * share,
        flux * (mean * share + edge * (bell - end_bell)),
        flux * ((mean**2 + variance) * share + edge * (bell * (mean + rate.threshold) - end_bell * (mean + _UPPER))),
    )
