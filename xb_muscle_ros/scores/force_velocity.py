"""Force against velocity of shortening: Hill's hyperbola (Hill 1938) and power."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import curve_fit
from scipy.stats import t as student

from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.trials.trial import Array

_FEWEST = 4
_FITTED = 2
# Loads or velocities nearer to each other than this share of the largest are the same.
_DIFFERENT, _APART = 3, 0.01
# a/F0 of muscle is 0.1 to 0.5; where points bend the other way, or not at all, the fit ends at one of these.
_CURVATURE = (1e-3, 100.0)
_NEAR_BOUND = 1e-3


class HillCurve(NamedTuple):
    """(f + a)(v + b) = (1 + a)·b, with force f over the isometric force and velocity v of shortening.

    Standard errors are those of the scatter around the curve; None where no point is left for them.

    Attributes:
        a: over the isometric force.
        b_l0_per_s: L0/s.
        vmax_l0_per_s: b/a, shortening without load, L0/s.
        power_l0_per_s: largest f·v, L0/s.
        load_at_power: f where it is.
        se: standard errors of a, b and vmax; None each where not known.
        interval: half width of a 95 % interval in standard errors.
        rmsd: of the points from the curve, in what was fitted.
        points: how many.
    """

    a: float
    b_l0_per_s: float
    vmax_l0_per_s: float
    power_l0_per_s: float
    load_at_power: float
    se: tuple[float | None, float | None, float | None]
    interval: float
    rmsd: float
    points: int


def hill_velocity(load: Array, a: float, vmax_l0_per_s: float) -> Array:
    """Velocity of shortening (L0/s) at loads over the isometric force, shape (n,)."""
    velocity: Array = a * vmax_l0_per_s * (1.0 - load) / (load + a)
    return velocity


def hill_force(velocity_l0_per_s: Array, a: float, vmax_l0_per_s: float) -> Array:
    """Force over the isometric force at velocities of shortening (L0/s), shape (n,)."""
    b = a * vmax_l0_per_s
    force: Array = (b - a * velocity_l0_per_s) / (b + velocity_l0_per_s)
    return force


def fit_hill(load: Array, velocity_l0_per_s: Array, load_is_given: bool = True) -> HillCurve | Missing:
    """Fit Hill's hyperbola through force 1 at velocity 0.

    Args:
        load: force over the isometric force, shape (n,); points outside 0 to 1 are left out, as are NaN.
        velocity_l0_per_s: of shortening, positive, shape (n,), L0/s.
        load_is_given: velocities have the errors (force clamp); else forces have (constant velocity).

    Returns:
        nothing for fewer than 4 points of shortening, or where they are no hyperbola.
    """
    used = np.isfinite(load) & np.isfinite(velocity_l0_per_s)
    used &= (load > -1e-9) & (load < 1.0) & (velocity_l0_per_s > 0.0)
    f, v = load[used], velocity_l0_per_s[used]
    if f.size < _FEWEST:
        return Missing(f"shortening is known at {f.size} loads below the isometric force; {_FEWEST} are needed")
    x, y, curve = (f, v, hill_velocity) if load_is_given else (v, f, hill_force)
    different = 1 + int(np.count_nonzero(np.diff(np.sort(x)) > _APART * float(np.max(x))))
    if different < _DIFFERENT:
        what = "loads" if load_is_given else "velocities"
        return Missing(f"there are {different} different {what} of shortening; {_DIFFERENT} are needed")
    start = (0.3, float(np.max(v)) * 1.3)
    bounds = ((_CURVATURE[0], 0.2 * float(np.max(v))), (_CURVATURE[1], 100.0 * float(np.max(v))))
    try:
        found, covariance = curve_fit(curve, x, y, p0=start, bounds=bounds, xtol=1e-12, ftol=1e-12)
    except (RuntimeError, ValueError):
        return Missing("no hyperbola could be fitted")
    a, vmax = (float(value) for value in found)
    inside = [
        low * (1.0 + _NEAR_BOUND) < value < high * (1.0 - _NEAR_BOUND)
        for low, value, high in zip(bounds[0], found, bounds[1], strict=True)
    ]
    if not all(inside):
        return Missing(f"the points are no hyperbola of Hill's: the best has a/F0 = {a:.3g} and vmax {vmax:.3g} L0/s")
    b = a * vmax
    errors = _errors(covariance, a, vmax) if f.size > _FITTED else (None, None, None)
    # d(f·v)/df = 0.
    best = float(np.sqrt(a * a + a) - a)
    power = best * float(hill_velocity(np.array(best), a, vmax))
    rmsd = float(np.sqrt(np.mean((curve(x, a, vmax) - y) ** 2)))
    width = float(student.ppf(0.975, max(f.size - _FITTED, 1)))
    return HillCurve(a, b, vmax, power, best, errors, width, rmsd, int(f.size))


def _errors(covariance: Array, a: float, vmax: float) -> tuple[float | None, float | None, float | None]:
    """Standard errors of a, of b = a·vmax and of vmax."""
    if not np.all(np.isfinite(covariance)):
        return None, None, None
    slope = np.array([vmax, a])
    return (
        float(np.sqrt(covariance[0, 0])),
        float(np.sqrt(slope @ covariance @ slope)),
        float(np.sqrt(covariance[1, 1])),
    )
