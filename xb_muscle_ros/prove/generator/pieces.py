"""Pieces of the stepping loop that know one thing each: a head's force, springs, filaments.

Propagators take a step of any length without becoming unstable.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

from xb_muscle_ros.prove.generator.layout import At, Series, Thick, Thin
from xb_muscle_ros.trials.trial import Array

F = TypeVar("F", bound=Callable[..., Any])

# The loop knows constants of a module, but not the members of an enumeration.
_KON, _KOFF, _KOOP, _KAPPA, _N = (int(i) for i in (At.KON, At.KOFF, At.KOOP, At.KAPPA, At.N))
_TAU_ACT, _AFFINITY = int(At.TAU_ACT), int(At.AFFINITY)
_J1, _J2, _JF, _JS = (int(i) for i in (At.J1, At.J2, At.JF, At.J_SATURATION))
_KSE, _KSE0, _SF, _SL, _GAMMA = (int(i) for i in (At.KSE, At.KSE0, At.SERIES_FORCE, At.SERIES_LENGTH, At.GAMMA))
_LS, _LB, _OS, _OE = (int(i) for i in (At.LATTICE_SLOPE, At.LATTICE_BEST, At.OVERLAP_SLOPE, At.OVERLAP_EDGE))
_THIN, _THICK, _SERIES = int(At.THIN), int(At.THICK), int(At.SERIES)
_SIGMOID, _REGULATED = int(Thin.SIGMOID), int(Thick.FORCE_DEPENDENT)
_EXPONENTIAL, _RIGID = int(Series.EXPONENTIAL), int(Series.RIGID)

# Bound heads at which affinity is as the constants say.
_USUAL_Q0 = 0.2


def compiled(function: F) -> F:
    """The function compiled when it is first used, and kept on disk."""
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))


@compiled
def head_force(z: float, curvature: float) -> float:
    """Force of a head of elongation z (1: one power stroke): stiffer beyond 1, softer when compressed; 1 at z = 1."""
    if z > 1.0:
        return z + curvature * (z - 1.0) ** 2 / (1.0 + 0.15 * (z - 1.0))
    if z < 0.0:
        return z / (1.0 - 4.0 * curvature * z)
    return z


@compiled
def head_stiffness(z: float, curvature: float) -> float:
    if z > 1.0:
        y = z - 1.0
        return 1.0 + curvature * y * (2.0 + 0.15 * y) / (1.0 + 0.15 * y) ** 2
    if z < 0.0:
        return 1.0 / (1.0 - 4.0 * curvature * z) ** 2
    return 1.0


@compiled
def series_length(tension: float, p: Array) -> float:
    """Length of the series spring at a force, power strokes; straight on below zero force."""
    if p[_SERIES] == _RIGID:
        return 0.0
    if p[_SERIES] == _EXPONENTIAL:
        if tension < 0.0:
            return float(tension / (p[_KSE] * p[_KSE0]))
        return float(np.log(1.0 + tension / p[_KSE0]) / p[_KSE])
    if tension < 0.0:
        return float(p[_SL] * tension / p[_SF])
    return float(0.5 * p[_SL] * (np.sqrt(1.0 + 4.0 * tension / p[_SF]) - 1.0))


@compiled
def series_slope(tension: float, p: Array) -> float:
    taut = max(tension, 0.0)
    if p[_SERIES] == _RIGID:
        return 0.0
    if p[_SERIES] == _EXPONENTIAL:
        return float(1.0 / (p[_KSE] * (taut + p[_KSE0])))
    return float(p[_SL] / p[_SF] / np.sqrt(1.0 + 4.0 * taut / p[_SF]))


@compiled
def thin(n_on: float, q0: float, calcium: float, switch_off: float, h: float, p: Array) -> float:
    """Active sites after h, with bound heads held."""
    if p[_THIN] == _SIGMOID:
        felt = calcium * 10.0 ** (p[_AFFINITY] * (q0 - _USUAL_Q0))
        target = 1.0 / (1.0 + (p[_KAPPA] / felt) ** p[_N])
        target /= 1.0 + (switch_off - 1.0) * (1.0 - target)
        # Neighbours that hold each other are slow where about half of them are on.
        lag = p[_TAU_ACT] * (1.0 + 60.0 * p[_AFFINITY] * n_on * (1.0 - n_on))
        return float(target + (n_on - target) * np.exp(-h / lag))
    on, off, koop = p[_KON] * calcium, p[_KOFF] * switch_off, p[_KOOP]
    # n' = a + b n + c n²
    a = on + off * q0 * (1.0 + koop)
    b = on * (koop - 1.0) - off * (1.0 + koop) - off * q0 * koop
    c = koop * (off - on)
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    half = 0.5 * root * h
    t = h * 0.5 if half < 1e-9 else np.tanh(half) / root
    rate = a + b * n_on + c * n_on * n_on
    return float(n_on + 2.0 * rate * t / (1.0 - (b + 2.0 * c * n_on) * t))


@compiled
def thick(drx: float, q0: float, torn: float, force: float, recruitment: float, h: float, p: Array) -> float:
    """Heads ready to attach after h, with bound heads held."""
    if p[_THICK] != _REGULATED:
        return 1.0 - q0 - torn
    pull = max(force, 0.0)
    if p[_JS] > 0.0:
        pull /= 1.0 + pull / p[_JS]
    up = p[_J1] * (1.0 + p[_JF] * pull + recruitment)
    total = up + p[_J2]
    target = up * (1.0 - q0 - torn) / total
    return float(target + (drx - target) * np.exp(-total * h))


@compiled
def attachment(length: float, p: Array) -> float:
    """Factor of the attachment rate by the filaments' distance, which falls as the half-sarcomere is stretched."""
    if p[_LS] == 0.0:
        return 1.0
    best = p[_LB]
    distance = 1.0 / np.sqrt(max(1.0 + length / p[_GAMMA], 0.1))
    # LATTICE_SLOPE is the factor's relative slope at rest.
    return float(np.exp(((1.0 - best) ** 2 - (distance - best) ** 2) * p[_LS] / (1.0 - best)))


@compiled
def overlap(length: float, p: Array) -> float:
    """Share of sites within reach of heads: all up to an edge, then falling in a straight line."""
    return float(max(0.0, 1.0 - p[_OS] * max(0.0, length / p[_GAMMA] - p[_OE])))
