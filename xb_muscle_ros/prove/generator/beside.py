"""Springs and dampers beside the heads: force in F0 from length, velocity and calcium alone."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.prove.generator.pieces import compiled
from xb_muscle_ros.prove.generator.world import SAMPLE_S, Stimulus
from xb_muscle_ros.trials.trial import Array


def velocity(length: Array) -> Array:
    """Velocity in the interval that ends at each sample, L0/s, shape (n,); 0 at the first."""
    return np.diff(length, prepend=length[0]) / SAMPLE_S


def saturating_drag(s: Stimulus, drag_s: float, bend: float) -> Array:
    """Drag that bends over: drag_s v/(1 + |v|/bend), bend in L0/s."""
    v = velocity(s.length)
    return drag_s * v / (1.0 + np.abs(v) / bend)


def leaky(drive: Array, tau_s: float) -> Array:
    """Solution of x' = drive - x/tau from 0, exact for a drive that is constant between samples; shape (n,)."""
    left = np.exp(-SAMPLE_S / tau_s)
    driven = drive.copy()
    driven[0] = 0.0
    return np.asarray(lfilter([tau_s * (1.0 - left)], [1.0, -left], driven))


def power_law_relaxation(s: Stimulus, stiffness: float, exponent: float, steepness: float) -> Array:
    """Four Maxwell arms whose springs stiffen exponentially; weights fall with the power `exponent` of their time.

    Args:
        stiffness: of all arms together at a sudden small stretch, F0/L0.
        steepness: of the springs, 1/L0.
    """
    times = np.array([0.01, 0.06, 0.4, 2.5])
    weights = times**-exponent / np.sum(times**-exponent)
    v = velocity(s.length)
    total = np.zeros(s.length.size)
    for tau, weight in zip(times, weights, strict=True):
        total += weight * np.expm1(steepness * leaky(v, tau)) / steepness
    return stiffness * total


@compiled
def slipping_friction(length: Array, way: float, unevenness: float, release_s: float) -> Array:
    """Links that are elastic, slip at their way and form anew, over the force of all of them at the way; shape (n,).

    Links are cohorts by the sample at which they formed, each on a spring from the length of then. The strains at which
    the links of a cohort slip have a Weibull distribution.

    Args:
        way: at which all but 1/e of the links have slipped, L0.
        unevenness: inverse of the distribution's shape.
        release_s: time constant with which links let go, and with which free ones form.
    """
    n = length.size
    cohorts, total = np.zeros(n), np.zeros(n)
    cohorts[0], free, oldest = 1.0, 0.0, 0
    left = np.exp(-SAMPLE_S / release_s)
    for k in range(1, n):
        force, lost = 0.0, 0.0
        for j in range(oldest, k):
            strain, before, kept = (length[k] - length[j]) / way, (length[k - 1] - length[j]) / way, left
            if abs(strain) > abs(before):
                kept *= np.exp(abs(before) ** (1.0 / unevenness) - abs(strain) ** (1.0 / unevenness))
            lost += cohorts[j] * (1.0 - kept)
            cohorts[j] *= kept
            force += cohorts[j] * strain
        while oldest < k - 1 and cohorts[oldest] < 1e-9:
            free += cohorts[oldest]
            oldest += 1
        formed = (free + lost) * (1.0 - left)
        free += lost - formed
        cohorts[k] = formed
        total[k] = force
    return total


def bound_titin(s: Stimulus, stiffness: float, contour: float, rebind_s: float, half_pca: float, hill: float) -> Array:
    """Titin bound to actin where it was when the fibre was activated: a worm-like chain from there on.

    Shortening leaves it slack, and it binds anew, shorter, with the time constant `rebind_s`.

    Args:
        stiffness: F0/L0 at small extension, if calcium has bound to all molecules.
        contour: extension at which the chain is straight, L0.
        half_pca, hill: see `_titin_share`.
    """
    length = s.length
    anchor, force = length[0], np.zeros(length.size)
    left = np.exp(-SAMPLE_S / rebind_s)
    for k in range(length.size):
        if length[k] < anchor:
            anchor = length[k] + (anchor - length[k]) * left
        y = min(max(length[k] - anchor, 0.0) / contour, 0.95)
        force[k] = (0.25 / (1.0 - y) ** 2 - 0.25 + y) / 1.5 * contour
    return _titin_share(s, half_pca, hill) * stiffness * force


def stiffened_titin(s: Stimulus, stiffness: float, steepness: float, half_pca: float, hill: float) -> Array:
    """Exponential spring from rest length on, stiffer by the share of calcium that is bound."""
    share = _titin_share(s, half_pca, hill)
    return np.asarray(share * stiffness * np.expm1(steepness * np.maximum(s.length, 0.0)) / steepness)


def _titin_share(s: Stimulus, half_pca: float, hill: float) -> float:
    """Share of sites on titin that calcium occupies."""
    return float(1.0 / (1.0 + (10.0 ** (6.0 - half_pca) / s.calcium) ** hill))
