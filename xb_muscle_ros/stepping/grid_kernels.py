"""One step of a model on a strain grid: loops over bins around the model's scalar functions.

The text below is compiled anew beside each model's own functions: see `models.grid_codegen`. A state vector holds the
bins n_i (heads per power stroke), the other states, the shift of the grid, then the inputs. Behind the parameters, p
holds the tables of the rates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

N_OTHERS = 0
N_PARAMETERS = 0
N_RATES = 0
BINS = 0
RANGE = 0
GAMMA = 0.0
TEARS = False
TORN = -1
IS_STEP = (False,)
ERROR_SHARE = 0.0

# Of `symbolic.intrinsics`.
limited: Callable[[float], float]
# Scalar functions of the model, each returning a tuple; see `models.grid_codegen`.
table_slopes: Callable[..., Any]
factors: Callable[..., Any]
spreads: Callable[..., Any]
leaving: Callable[..., Any]
tearing_off: Callable[..., Any]
others: Callable[..., Any]
couplings: Callable[..., Any]
output_scalars: Callable[..., Any]
rest_of_others: Callable[..., Any]
others_violation: Callable[..., Any]


# BEGIN COMPILED
def prepare(p: Array) -> Any:
    """Parameters with the tables of the rates behind them: exp(slope X_i), one row for each rate."""
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    whole = np.zeros(N_PARAMETERS + N_RATES * bins)
    for i in range(N_PARAMETERS):
        whole[i] = p[i]
    slopes = table_slopes(p)
    for k in range(N_RATES):
        for i in range(bins):
            exponent = slopes[k] * (i * dx - p[RANGE])
            # A rate levels off as the moments' does. A step's exponential is none: past exp(700) a double ends.
            exponent = min(exponent, 690.0) if IS_STEP[k] else limited(exponent)
            whole[N_PARAMETERS + k * bins + i] = math.exp(exponent)
    return whole


def rest(p: Array, out: Array) -> None:
    """No heads attached, the other states at rest, the grid where heads attach."""
    bins = int(p[BINS])
    for i in range(bins):
        out[i] = 0.0
    rest_of_others(p, out[bins : bins + N_OTHERS])
    out[bins + N_OTHERS] = 0.0


def attach(rates: Any, shift: float, p: Array, density: Array) -> float:
    """Density of attaching heads over the bins (1/s per power stroke); returns the heads per second that come back."""
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    for i in range(bins):
        density[i] = 0.0
    back = 0.0
    for k in range(len(rates) // 2):
        rate = rates[2 * k]
        width = rates[2 * k + 1]
        if k > 0:
            back += rate
        scale = rate / (width * math.sqrt(2.0 * math.pi))
        # Past eight widths a Gaussian is below 1e-14 of its height.
        first = max(0, int(math.ceil((p[RANGE] - shift - 8.0 * width) / dx)))
        last = min(bins - 1, int(math.floor((p[RANGE] - shift + 8.0 * width) / dx)))
        for i in range(first, last + 1):
            x = (i * dx - p[RANGE] + shift) / width
            density[i] += scale * math.exp(-0.5 * x * x)
    return back


def unit_gaussian(width: float, shift: float, p: Array, density: Array) -> None:
    """One head, spread over the bins around strain 0."""
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    scale = 1.0 / (width * math.sqrt(2.0 * math.pi))
    for i in range(bins):
        x = (i * dx - p[RANGE] + shift) / width
        density[i] = scale * math.exp(-0.5 * x * x)


def sums_over_bins(n: Array, bins: int) -> Any:
    """Sums of n_i, i n_i and i² n_i; four partial sums each, so that additions need not wait for one another."""
    a0 = a1 = a2 = a3 = 0.0
    b0 = b1 = b2 = b3 = 0.0
    c0 = c1 = c2 = c3 = 0.0
    whole = bins - bins % 4
    for i in range(0, whole, 4):
        x = float(i)
        n0 = n[i]
        n1 = n[i + 1]
        n2 = n[i + 2]
        n3 = n[i + 3]
        a0 += n0
        a1 += n1
        a2 += n2
        a3 += n3
        m0 = x * n0
        m1 = (x + 1.0) * n1
        m2 = (x + 2.0) * n2
        m3 = (x + 3.0) * n3
        b0 += m0
        b1 += m1
        b2 += m2
        b3 += m3
        c0 += x * m0
        c1 += (x + 1.0) * m1
        c2 += (x + 2.0) * m2
        c3 += (x + 3.0) * m3
    for i in range(whole, bins):
        x = float(i)
        a0 += n[i]
        b0 += x * n[i]
        c0 += x * x * n[i]
    return (a0 + a1) + (a2 + a3), (b0 + b1) + (b2 + b3), (c0 + c1) + (c2 + c3)


def moments(n: Array, bins: int, dx: float, lowest: float) -> Any:
    """Zeroth to second moment over strain of a density whose first bin lies at the strain `lowest`."""
    s0, s1, s2 = sums_over_bins(n, bins)
    q0 = s0 * dx
    q1 = s1 * dx * dx
    q2 = s2 * dx * dx * dx
    return q0, q1 + lowest * q0, q2 + 2.0 * lowest * q1 + lowest * lowest * q0


def evaluate(
    n: Array, y: Any, shift: float, length: float, velocity: float, calcium: float, p: Array, flux: Array,
    going: Array, tearing: Array, density: Array,
) -> Any:  # fmt: skip
    """Net flux of every bin at a state, and the rates at which its heads leave.

    Returns:
        the sums over bins, in the order of the scalar functions' arguments.
    """
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    lowest = shift - p[RANGE]
    q0, q1, q2 = moments(n, bins, dx, lowest)
    c = factors(q0, q1, q2, shift, y, length, velocity, calcium, p)
    back = attach(spreads(q0, q1, q2, y, length, velocity, calcium, p), shift, p, density)
    # Loops with few arrays: compilers vectorise what they can tell apart.
    for i in range(bins):
        going[i] = leaving(c, N_PARAMETERS, bins, i, p)
    if TEARS:
        for i in range(bins):
            tearing[i] = tearing_off(c, N_PARAMETERS, bins, i, p)
        for i in range(bins):
            going[i] += tearing[i]
    for i in range(bins):
        flux[i] = density[i] - going[i] * n[i]
    torn = torn_sum(tearing, n, bins)
    kin0, kin1, kin2 = moments(flux, bins, dx, lowest)
    return q0, q1, q2, kin0, kin1, kin2, torn * dx, back


def torn_sum(tearing: Array, k: Array, bins: int) -> float:
    """Sum of tearing_i k_i; nothing to add where no head is torn off."""
    total = 0.0
    if TEARS:
        for i in range(bins):
            total += tearing[i] * k[i]
    return total


def attempt(s: Array, h: float, velocity: float, calcium: float, p: Array, out: Array, work: Array) -> float:
    """One step of `rosenbrock2` of h seconds; returns the largest embedded error.

    The matrix in place of the Jacobian has the bins' detachment rates and the other states' own decay on its diagonal,
    and below it how the other states and the velocity follow the bins: without that, the flux of heads that are about
    to detach would move the contractile element as if they stayed. Torn-off heads come back within a fraction of a
    millisecond: their state and the bins are solved together.
    """
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    k1 = work[4]
    k2 = work[5]
    going = work[6]
    tearing = work[7]
    density = work[8]
    other = work[9]
    scratch = work[10]
    inverse = work[11]
    lost = work[12]
    coming = work[13]
    shift = s[bins + N_OTHERS]
    lowest = shift - p[RANGE]
    length = s[bins + N_OTHERS + 1]
    gh = GAMMA * h
    y = s[bins : bins + N_OTHERS]
    sums = evaluate(s, y, shift, length, velocity, calcium, p, k1, going, tearing, density)
    rates = others(*sums, y, length, velocity, calcium, p)
    part = couplings(*sums, y, length, velocity, calcium, p)
    for i in range(bins):
        inverse[i] = 1.0 / (1.0 + gh * going[i])
    for i in range(bins):
        k1[i] *= inverse[i]
    comes_back = part[6 * (N_OTHERS + 1)]
    pivot = 1.0
    returned = 0.0
    if TORN >= 0:
        unit_gaussian(spreads(*sums[:3], y, length, velocity, calcium, p)[3], shift, p, coming)
        for i in range(bins):
            coming[i] *= gh * comes_back * inverse[i]
        pivot += gh * (comes_back - torn_sum(tearing, coming, bins) * dx)
        returned = (rates[TORN] + gh * torn_sum(tearing, k1, bins) * dx) / pivot
        for i in range(bins):
            k1[i] += returned * coming[i]
    for i in range(bins):
        out[i] = s[i] + h * k1[i]
    for i in range(bins):
        lost[i] = going[i] * k1[i]
    leave0, leave1, leave2 = moments(lost, bins, dx, lowest)
    leave_torn = torn_sum(tearing, k1, bins) * dx
    for j in range(N_OTHERS + 1):
        follow_bins = part[6 * j + 3] * leave_torn - part[6 * j] * leave0 - part[6 * j + 1] * leave1
        follow_bins += (part[6 * j] + part[6 * j + 5]) * comes_back * returned - part[6 * j + 2] * leave2
        own = min(part[6 * j + 4], 0.0)
        k1[bins + j] = returned if j == TORN else (rates[j] + gh * follow_bins) / (1.0 - gh * own)
        out[bins + j] = s[bins + j] + h * k1[bins + j]
    y2 = out[bins : bins + N_OTHERS]
    shift2 = out[bins + N_OTHERS]
    length2 = length + h * velocity
    sums2 = evaluate(out, y2, shift2, length2, velocity, calcium, p, k2, other, scratch, density)
    rates2 = others(*sums2, y2, length2, velocity, calcium, p)
    for i in range(bins):
        k2[i] = (k2[i] - 2.0 * k1[i]) * inverse[i]
    if TORN >= 0:
        returned = (rates2[TORN] - 2.0 * k1[bins + TORN] + gh * torn_sum(tearing, k2, bins) * dx) / pivot
        for i in range(bins):
            k2[i] += returned * coming[i]
    for i in range(bins):
        lost[i] = going[i] * k2[i]
    for i in range(bins):
        other[i] = k1[i] + k2[i]
    for i in range(bins):
        out[i] = s[i] + h * (k1[i] + 0.5 * other[i])
    leave0, leave1, leave2 = moments(lost, bins, dx, lowest)
    leave_torn = torn_sum(tearing, k2, bins) * dx
    e0, e1, _ = moments(other, bins, dx, lowest)
    error = max(abs(e0), abs(e1))
    for j in range(N_OTHERS + 1):
        follow_bins = part[6 * j + 3] * leave_torn - part[6 * j] * leave0 - part[6 * j + 1] * leave1
        follow_bins += (part[6 * j] + part[6 * j + 5]) * comes_back * returned - part[6 * j + 2] * leave2
        own = min(part[6 * j + 4], 0.0)
        k2[bins + j] = returned if j == TORN else (rates2[j] - 2.0 * k1[bins + j] + gh * follow_bins) / (1.0 - gh * own)
        error = max(error, abs(k1[bins + j] + k2[bins + j]))
        out[bins + j] = s[bins + j] + h * (1.5 * k1[bins + j] + 0.5 * k2[bins + j])
    error *= 0.5 * h * ERROR_SHARE
    return error if error == error else math.inf


def slope(s: Array, velocity: float, calcium: float, p: Array, out: Array) -> None:
    """Rates of change of bins, other states and shift; bins move with the grid."""
    bins = int(p[BINS])
    work = np.empty((4, bins))
    y = s[bins : bins + N_OTHERS]
    length = s[bins + N_OTHERS + 1]
    sums = evaluate(s, y, s[bins + N_OTHERS], length, velocity, calcium, p, work[0], work[1], work[2], work[3])
    rates = others(*sums, y, length, velocity, calcium, p)
    for i in range(bins):
        out[i] = work[0, i]
    for j in range(N_OTHERS + 1):
        out[bins + j] = rates[j]


def outputs(s: Array, p: Array, out: Array) -> None:
    """Forces, contractile element and states."""
    bins = int(p[BINS])
    n = s.shape[0]
    work = np.empty((4, bins))
    y = s[bins : bins + N_OTHERS]
    sums = evaluate(s, y, s[bins + N_OTHERS], s[n - 3], s[n - 2], s[n - 1], p, work[0], work[1], work[2], work[3])
    values = output_scalars(*sums, y, s[n - 3], s[n - 2], s[n - 1], p)
    for i in range(len(values)):
        out[i] = values[i]


def violation(s: Array, p: Array, slack: float) -> int:
    """Index of the first state that is not finite or out of its bounds by more than `slack`, else -1.

    Bins are judged by the heads they hold. A grid that does not follow must still cover the strains where heads attach.
    """
    bins = int(p[BINS])
    dx = 2.0 * p[RANGE] / (bins - 1)
    heads = 0.0
    for i in range(bins):
        heads += s[i]
        if not s[i] * dx >= -slack:
            return i
    if not heads * dx <= 1.0 + slack:
        return int(np.argmax(s[:bins]))
    if not abs(s[bins + N_OTHERS]) <= p[RANGE] - 1.0 + 1e-9:
        return bins + N_OTHERS
    return int(others_violation(s, bins, slack))
