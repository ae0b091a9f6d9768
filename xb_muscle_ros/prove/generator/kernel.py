"""The stepping loop: heads on a strain grid that moves with them, force balance solved in every step.

One step is symmetric. Strains move by half of the step's expected way; heads attach and detach there, each bin by its
exact exponential; then the length of every half-sarcomere is found that balances the force at the step's end. Thin
filament (exact solution of its Riccati equation) and thick filament (exponential) take half a step before and half a
step behind, so that every part is of second order and none is unstable. No interpolation: the grid keeps an offset of
less than a bin, and bins are renumbered when it exceeds that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
import numpy.typing as npt

from xb_muscle_ros.prove.generator.layout import At, Series, Thick, Thin

Array = npt.NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])

# The loop knows constants of a module, but not the members of an enumeration.
_F, _W, _K11, _K12, _K21, _K22 = (int(i) for i in (At.F, At.W, At.K11, At.K12, At.K21, At.K22))
_KON, _KOFF, _KOOP, _KAPPA, _N = (int(i) for i in (At.KON, At.KOFF, At.KOOP, At.KAPPA, At.N))
_TAU_ACT, _AFFINITY = int(At.TAU_ACT), int(At.AFFINITY)
_J1, _J2, _JF, _JS = (int(i) for i in (At.J1, At.J2, At.JF, At.J_SATURATION))
_KSE, _KSE0, _SF, _SL, _GAMMA = (int(i) for i in (At.KSE, At.KSE0, At.SERIES_FORCE, At.SERIES_LENGTH, At.GAMMA))
_TK, _TX, _TS, _TB = (int(i) for i in (At.TEAR_RATE, At.TEAR_STRAIN, At.TEAR_STEEPNESS, At.REBIND_RATE))
_CURVE, _PI = int(At.HEAD_CURVATURE), int(At.PHOSPHATE_RATE)
_LS, _LB, _OS, _OE = (int(i) for i in (At.LATTICE_SLOPE, At.LATTICE_BEST, At.OVERLAP_SLOPE, At.OVERLAP_EDGE))
_WK, _WR, _WX, _WL = (int(i) for i in (At.WEAK_STIFFNESS, At.WEAK_RATE, At.WEAK_STRAIN, At.WEAK_LAG))
_CC, _CT, _UK = (int(i) for i in (At.CREEP, At.CREEP_TIME, At.UNIT_STIFFNESS))
_THIN, _THICK, _SERIES = int(At.THIN), int(At.THICK), int(At.SERIES)
_SIGMOID, _REGULATED = int(Thin.SIGMOID), int(Thick.FORCE_DEPENDENT)
_EXPONENTIAL, _RIGID = int(Series.EXPONENTIAL), int(Series.RIGID)

# Bound heads at which affinity is as the constants say.
_USUAL_Q0 = 0.2

# Rows of a half-sarcomere's state.
N_ON, DRX, TORN, LENGTH, OFFSET, WEAK_SITES, WEAK_FORCE, Q0, FORCE, LAST_MOVE = range(10)
ROWS = 10
# Entries of the state that all half-sarcomeres share.
TENSION, CREPT, LAST_CHANGE = range(3)
SHARED = 3
# Rows of what acts in a step: calcium (µM), factors of attachment and of koff, added recruitment (as J1's factor).
CALCIUM, ATTACHMENT, SWITCH_OFF, RECRUITMENT = range(4)


def _compiled(function: F) -> F:
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))


@_compiled
def _head_force(z: float, curvature: float) -> float:
    """Force of a head of elongation z (1: one power stroke): stiffer beyond 1, softer when compressed; 1 at z = 1."""
    if z > 1.0:
        return z + curvature * (z - 1.0) ** 2 / (1.0 + 0.15 * (z - 1.0))
    if z < 0.0:
        return z / (1.0 - 4.0 * curvature * z)
    return z


@_compiled
def _head_stiffness(z: float, curvature: float) -> float:
    if z > 1.0:
        y = z - 1.0
        return 1.0 + curvature * y * (2.0 + 0.15 * y) / (1.0 + 0.15 * y) ** 2
    if z < 0.0:
        return 1.0 / (1.0 - 4.0 * curvature * z) ** 2
    return 1.0


@_compiled
def series_length(tension: float, p: Array) -> float:
    """Length of the series spring at a force, power strokes; straight on below zero force."""
    if p[_SERIES] == _RIGID:
        return 0.0
    if p[_SERIES] == _EXPONENTIAL:
        if tension < 0.0:
            return tension / (p[_KSE] * p[_KSE0])
        return np.log(1.0 + tension / p[_KSE0]) / p[_KSE]
    if tension < 0.0:
        return p[_SL] * tension / p[_SF]
    return 0.5 * p[_SL] * (np.sqrt(1.0 + 4.0 * tension / p[_SF]) - 1.0)


@_compiled
def _series_slope(tension: float, p: Array) -> float:
    taut = max(tension, 0.0)
    if p[_SERIES] == _RIGID:
        return 0.0
    if p[_SERIES] == _EXPONENTIAL:
        return 1.0 / (p[_KSE] * (taut + p[_KSE0]))
    return p[_SL] / p[_SF] / np.sqrt(1.0 + 4.0 * taut / p[_SF])


@_compiled
def _thin(n_on: float, q0: float, calcium: float, switch_off: float, h: float, p: Array) -> float:
    """Active sites after h, with bound heads held."""
    if p[_THIN] == _SIGMOID:
        felt = calcium * 10.0 ** (p[_AFFINITY] * (q0 - _USUAL_Q0))
        target = 1.0 / (1.0 + (p[_KAPPA] / felt) ** p[_N])
        target /= 1.0 + (switch_off - 1.0) * (1.0 - target)
        # Neighbours that hold each other are slow where about half of them are on.
        lag = p[_TAU_ACT] * (1.0 + 60.0 * p[_AFFINITY] * n_on * (1.0 - n_on))
        return target + (n_on - target) * np.exp(-h / lag)
    on, off, koop = p[_KON] * calcium, p[_KOFF] * switch_off, p[_KOOP]
    # n' = a + b n + c n²
    a = on + off * q0 * (1.0 + koop)
    b = on * (koop - 1.0) - off * (1.0 + koop) - off * q0 * koop
    c = koop * (off - on)
    root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
    half = 0.5 * root * h
    t = h * 0.5 if half < 1e-9 else np.tanh(half) / root
    rate = a + b * n_on + c * n_on * n_on
    return n_on + 2.0 * rate * t / (1.0 - (b + 2.0 * c * n_on) * t)


@_compiled
def _thick(drx: float, q0: float, torn: float, force: float, recruitment: float, h: float, p: Array) -> float:
    """Heads ready to attach after h, with bound heads held."""
    if p[_THICK] != _REGULATED:
        return 1.0 - q0 - torn
    pull = max(force, 0.0)
    if p[_JS] > 0.0:
        pull /= 1.0 + pull / p[_JS]
    up = p[_J1] * (1.0 + p[_JF] * pull + recruitment)
    total = up + p[_J2]
    target = up * (1.0 - q0 - torn) / total
    return target + (drx - target) * np.exp(-total * h)


@_compiled
def _attachment(length: float, p: Array) -> float:
    """Factor of the attachment rate by the distance of the filaments, which falls as the half-sarcomere is stretched."""
    if p[_LS] == 0.0:
        return 1.0
    best = p[_LB]
    distance = 1.0 / np.sqrt(max(1.0 + length / p[_GAMMA], 0.1))
    # LATTICE_SLOPE is the factor's relative slope at rest.
    return np.exp(((1.0 - best) ** 2 - (distance - best) ** 2) * p[_LS] / (1.0 - best))


@_compiled
def _overlap(length: float, p: Array) -> float:
    """Share of sites within reach of heads: all up to an edge, then falling in a straight line."""
    return max(0.0, 1.0 - p[_OS] * max(0.0, length / p[_GAMMA] - p[_OE]))


@_compiled
def _heads(
    n: Array, unit: Array, move: float, attachment: float, h: float, x0: float, dx: float, p: Array, work: Array
) -> None:
    """Attachment and detachment over h at strains half-way through the step; updates heads, ready and torn heads."""
    bins = n.size
    shift = unit[OFFSET] + move
    slow, fast = p[_K11] * np.exp(-p[_K12] * shift), p[_K21] * np.exp(p[_K22] * shift)
    length = unit[LENGTH] + move
    f = p[_F] * attachment * _attachment(length, p)
    sites = unit[N_ON] * _overlap(length, p)
    tears, q0 = p[_TK] > 0.0, unit[Q0]
    source = f * max(0.0, unit[DRX] * (sites - q0))
    rebound_rate = 0.0
    rebound = unit[TORN]
    half_q0, torn_rate = 0.0, 0.0
    norm = 1.0 / (p[_W] * np.sqrt(2.0 * np.pi))
    total_weight = 0.0
    # Rows of work: rate, exp(-rate h/2), attachment profile, tearing rate, tables of both exponentials.
    for i in range(bins):
        x = x0 + i * dx + shift
        rate = slow * work[4, i] + fast * work[5, i]
        if p[_PI] > 0.0:
            rate += p[_PI] / (1.0 + np.exp(x / 0.15))
        if tears:
            work[3, i] = p[_TK] / (1.0 + np.exp(-p[_TS] * (x - p[_TX])))
            rate += work[3, i]
        y = x / p[_W]
        work[2, i] = norm * np.exp(-0.5 * y * y) if y * y < 80.0 else 0.0
        total_weight += work[2, i]
        work[0, i] = rate
        work[1, i] = np.exp(-0.5 * rate * h)
    total_weight *= dx
    if tears:
        for i in range(bins):
            torn_rate += work[3, i] * n[i]
        torn_rate *= dx
        decay = np.exp(-0.5 * p[_TB] * h)
        rebound_rate = p[_TB] * (rebound * decay + torn_rate * (1.0 - decay) / p[_TB])
    for i in range(bins):
        left = work[1, i]
        half_q0 += n[i] * left + work[2, i] * (source + rebound_rate) * (1.0 - left) / work[0, i]
    half_q0 *= dx
    ready = unit[DRX]
    if p[_THICK] != _REGULATED:
        ready = 1.0 - half_q0 - rebound
    else:
        ready -= half_q0 - q0 - 0.5 * h * rebound_rate
    source = f * max(0.0, ready * (sites - half_q0))
    if tears:
        decay = np.exp(-p[_TB] * h)
        rebound_rate = (rebound * (1.0 - decay) + torn_rate * (h - (1.0 - decay) / p[_TB])) / h
    new_q0, torn = 0.0, 0.0
    gain = source + rebound_rate
    for i in range(bins):
        left = work[1, i] * work[1, i]
        before = n[i]
        n[i] = before * left + work[2, i] * gain * (1.0 - left) / work[0, i]
        new_q0 += n[i]
        if tears:
            torn += (before + work[2, i] * gain * h - n[i]) * work[3, i] / work[0, i]
    new_q0 *= dx
    torn *= dx
    back = rebound_rate * h * total_weight
    unit[TORN] += torn - back
    if p[_THICK] == _REGULATED:
        # Ready heads lose what attaches anew and win what detaches without being torn off.
        unit[DRX] -= new_q0 - q0 + torn - back
    unit[Q0] = new_q0
    if p[_THICK] != _REGULATED:
        unit[DRX] = 1.0 - new_q0 - unit[TORN]


@_compiled
def _weak(unit: Array, h: float, p: Array) -> None:
    """Weakly bound heads: as many as sites are active, let go the faster the more they are strained."""
    unit[WEAK_SITES] = unit[N_ON] + (unit[WEAK_SITES] - unit[N_ON]) * np.exp(-h / p[_WL])
    stiffness = p[_WK] * max(unit[WEAK_SITES], 1e-12)
    rate = p[_WR] * (1.0 + abs(unit[WEAK_FORCE]) / stiffness / p[_WX])
    unit[WEAK_FORCE] *= np.exp(-rate * h)


@_compiled
def _linear(n: Array, unit: Array, move: float, x0: float, dx: float, p: Array) -> tuple[float, float]:
    """Force and stiffness of a half-sarcomere's heads when all have moved by `move`."""
    force, stiffness = 0.0, 0.0
    if p[_CURVE] == 0.0:
        for i in range(n.size):
            force += n[i] * (x0 + i * dx)
        force = dx * force + unit[Q0] * (1.0 + unit[OFFSET] + move)
        return force, unit[Q0]
    for i in range(n.size):
        z = 1.0 + x0 + i * dx + unit[OFFSET] + move
        force += n[i] * _head_force(z, p[_CURVE])
        stiffness += n[i] * _head_stiffness(z, p[_CURVE])
    return dx * force, dx * stiffness


@_compiled
def _balance(
    n: Array, units: Array, strength: Array, shared: Array, length: float, x0: float, dx: float, p: Array, line: Array
) -> None:
    """Move every half-sarcomere to where all bear the force of the series spring.

    Args:
        length: fibre length change in power strokes at the end of the step.
        line: scratch, (units, 2): force without further movement and stiffness of each.
    """
    count = units.shape[0]
    moved = np.zeros(count)
    tension = shared[TENSION]
    free = length - shared[CREPT]
    for sweep in range(30):
        mean = 0.0
        compliance = 0.0
        for m in range(count):
            unit = units[m]
            force, stiffness = _linear(n[m], unit, moved[m], x0, dx, p)
            weak = p[_WK] * unit[WEAK_SITES]
            base = strength[m] * force + unit[WEAK_FORCE] + weak * moved[m]
            base += p[_UK] * (unit[LENGTH] + moved[m])
            slope = strength[m] * stiffness + weak + p[_UK]
            line[m, 0], line[m, 1] = base, max(slope, 1e-12)
            mean += unit[LENGTH] + moved[m] - base / line[m, 1]
            compliance += 1.0 / line[m, 1]
        mean /= count
        compliance /= count
        # mean + compliance T + series_length(T) = free: rising and concave, so Newton's steps cannot run away.
        for _ in range(60):
            error = mean + compliance * tension + series_length(tension, p) - free
            step = error / (compliance + _series_slope(tension, p))
            tension -= step
            if abs(step) < 1e-13 + 1e-12 * abs(tension):
                break
        largest = 0.0
        for m in range(count):
            change = (tension - line[m, 0]) / line[m, 1]
            moved[m] += change
            largest = max(largest, abs(change))
        if p[_CURVE] == 0.0 or largest < 1e-9:
            break
    shared[TENSION] = tension
    for m in range(count):
        unit = units[m]
        unit[FORCE] = _linear(n[m], unit, moved[m], x0, dx, p)[0]
        unit[WEAK_FORCE] += p[_WK] * unit[WEAK_SITES] * moved[m]
        unit[LENGTH] += moved[m]
        unit[LAST_MOVE] = moved[m]
        unit[OFFSET] += moved[m]
        _renumber(n[m], unit, dx)


@_compiled
def _renumber(n: Array, unit: Array, dx: float) -> None:
    """Bring the offset back within half a bin; heads that leave the grid are lost, far beyond where any stays."""
    k = int(np.floor(unit[OFFSET] / dx + 0.5))
    if k == 0:
        return
    bins = n.size
    unit[OFFSET] -= k * dx
    if k > 0:
        for i in range(bins - 1, -1, -1):
            n[i] = n[i - k] if i >= k else 0.0
    else:
        for i in range(bins):
            n[i] = n[i - k] if i - k < bins else 0.0
    total = 0.0
    for i in range(bins):
        total += n[i]
    unit[Q0] = total * dx


@_compiled
def _expected(units: Array, strength: Array, change: float, shared: Array, p: Array) -> None:
    """Half-sarcomeres' movement expected in this step: the last one, and their share of what the length does anew."""
    extra = change - shared[LAST_CHANGE]
    shared[LAST_CHANGE] = change
    if extra == 0.0:
        return
    count = units.shape[0]
    compliance = 0.0
    for m in range(count):
        slope = strength[m] * units[m, Q0] + p[_WK] * units[m, WEAK_SITES] + p[_UK]
        compliance += 1.0 / max(slope, 1e-12) / count
    for m in range(count):
        slope = strength[m] * units[m, Q0] + p[_WK] * units[m, WEAK_SITES] + p[_UK]
        units[m, LAST_MOVE] += extra / max(slope, 1e-12) / (compliance + _series_slope(shared[TENSION], p))


@_compiled
def advance(
    n: Array,
    units: Array,
    shared: Array,
    strength: Array,
    length: Array,
    acting: Array,
    h: float,
    every: int,
    x0: float,
    dx: float,
    p: Array,
    out: Array,
) -> None:
    """Step through a trial; the state is updated in place.

    Args:
        n: (units, bins), density of attached heads, 1/power stroke.
        units: (units, ROWS).
        shared: (SHARED,).
        strength: (units,), of each half-sarcomere relative to the mean.
        length: (steps + 1,), length change, L0; linear between.
        acting: (steps, 4), what acts in each step: see CALCIUM and its like.
        h: step, s.
        every: steps between samples.
        x0: strain of the first bin, power strokes.
        dx: width of a bin.
        p: constants by `At`.
        out: (steps // every, 3), written: tension (cross-bridge force), mean active sites, mean bound heads.
    """
    count = units.shape[0]
    work = np.empty((6, n.shape[1]))
    line = np.empty((count, 2))
    for i in range(n.shape[1]):
        x = x0 + i * dx
        work[4, i], work[5, i] = np.exp(-p[_K12] * x), np.exp(p[_K22] * x)
    for k in range(acting.shape[0]):
        _expected(units, strength, p[_GAMMA] * (length[k + 1] - length[k]), shared, p)
        calcium, switch_off, recruitment = acting[k, CALCIUM], acting[k, SWITCH_OFF], acting[k, RECRUITMENT]
        for m in range(count):
            unit = units[m]
            unit[N_ON] = _thin(unit[N_ON], unit[Q0], calcium, switch_off, 0.5 * h, p)
            unit[DRX] = _thick(unit[DRX], unit[Q0], unit[TORN], unit[FORCE], recruitment, 0.5 * h, p)
            _heads(n[m], unit, 0.5 * unit[LAST_MOVE], acting[k, ATTACHMENT], h, x0, dx, p, work)
            if p[_WK] > 0.0:
                _weak(unit, h, p)
        if p[_CC] > 0.0:
            target = p[_CC] * shared[TENSION]
            shared[CREPT] = target + (shared[CREPT] - target) * np.exp(-h / p[_CT])
        _balance(n, units, strength, shared, p[_GAMMA] * length[k + 1], x0, dx, p, line)
        for m in range(count):
            unit = units[m]
            unit[DRX] = _thick(unit[DRX], unit[Q0], unit[TORN], unit[FORCE], recruitment, 0.5 * h, p)
            unit[N_ON] = _thin(unit[N_ON], unit[Q0], calcium, switch_off, 0.5 * h, p)
        if (k + 1) % every == 0:
            row = (k + 1) // every - 1
            out[row, 0] = shared[TENSION]
            out[row, 1] = np.mean(units[:, N_ON])
            out[row, 2] = np.mean(units[:, Q0])


@_compiled
def level(calcium: float, x0: float, dx: float, bins: int, p: Array, unit: Array, n: Array) -> None:
    """Isometric equilibrium of a half-sarcomere at rest length, reached from below as a fibre is activated from rest."""
    weight = np.empty(bins)
    norm = 1.0 / (p[_W] * np.sqrt(2.0 * np.pi))
    bound, pull = 0.0, 0.0
    for i in range(bins):
        x = x0 + i * dx
        rate = p[_K11] * np.exp(-p[_K12] * x) + p[_K21] * np.exp(p[_K22] * x)
        if p[_PI] > 0.0:
            rate += p[_PI] / (1.0 + np.exp(x / 0.15))
        y = x / p[_W]
        weight[i] = p[_F] * norm * np.exp(-0.5 * y * y) / rate
        bound += weight[i] * dx
        pull += weight[i] * (1.0 + x) * dx
    n_on, q0, drx = 0.0, 0.0, 1.0
    if p[_THICK] == _REGULATED:
        drx = p[_J1] / (p[_J1] + p[_J2])
    for _ in range(20000):
        last = n_on + q0 + drx
        n_on = _thin(n_on, q0, calcium, 1.0, 1e-3, p)
        q0_level = drx * n_on * bound / (1.0 + drx * bound)
        q0 += 0.3 * (q0_level - q0)
        drx = _thick(drx, q0, 0.0, q0 / bound * pull, 0.0, 1e-3, p)
        if abs(n_on + q0 + drx - last) < 1e-12:
            break
    for i in range(bins):
        n[i] = weight[i] * q0 / bound
    unit[:] = 0.0
    unit[N_ON], unit[DRX], unit[Q0], unit[FORCE] = n_on, drx, q0, q0 / bound * pull
    unit[WEAK_SITES] = n_on
