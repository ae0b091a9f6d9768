"""The stepping loop: heads on a strain grid that moves with them, force balance solved in every step.

One step is symmetric. Strains move by half of the step's expected way; heads attach and detach there, each bin by its
exact exponential; then the length of every half-sarcomere is found that balances the force at the step's end. Thin
filament (exact solution of its Riccati equation) and thick filament (exponential) take half a step before and half a
step behind, so that every part is of second order and none is unstable. No interpolation: the grid keeps an offset of
less than a bin, and bins are renumbered when it exceeds that.
"""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.prove.generator.layout import At, Thick
from xb_muscle_ros.prove.generator.pieces import (
    attachment,
    compiled,
    head_force,
    head_stiffness,
    overlap,
    series_length,
    series_slope,
    thick,
    thin,
)
from xb_muscle_ros.trials.trial import Array

# The loop knows constants of a module, but not the members of an enumeration.
_F, _W, _K11, _K12, _K21, _K22 = (int(i) for i in (At.F, At.W, At.K11, At.K12, At.K21, At.K22))
_J1, _J2, _GAMMA, _THICK = (int(i) for i in (At.J1, At.J2, At.GAMMA, At.THICK))
_TK, _TX, _TS, _TB = (int(i) for i in (At.TEAR_RATE, At.TEAR_STRAIN, At.TEAR_STEEPNESS, At.REBIND_RATE))
_CURVE, _PI = int(At.HEAD_CURVATURE), int(At.PHOSPHATE_RATE)
_WK, _WR, _WX, _WL = (int(i) for i in (At.WEAK_STIFFNESS, At.WEAK_RATE, At.WEAK_STRAIN, At.WEAK_LAG))
_CC, _CT, _UK = (int(i) for i in (At.CREEP, At.CREEP_TIME, At.UNIT_STIFFNESS))
_REGULATED = int(Thick.FORCE_DEPENDENT)

# Heads attach within so many widths of the profile; fewer heads than this in a bin are rounding's.
_FARTHEST_WIDTHS, _NOBODY = 80.0**0.5, 1e-40

# Rows of a half-sarcomere's state.
N_ON, DRX, TORN, LENGTH, OFFSET, WEAK_SITES, WEAK_FORCE, Q0, FORCE, LAST_MOVE = range(10)
ROWS = 10
# Entries of the state that all half-sarcomeres share.
TENSION, CREPT, LAST_CHANGE = range(3)
SHARED = 3
# Rows of what acts in a step: calcium (µM), factors of attachment and of koff, added recruitment (as J1's factor).
CALCIUM, ATTACHMENT, SWITCH_OFF, RECRUITMENT = range(4)


@compiled
def _occupied(n: Array, shift: float, x0: float, dx: float, p: Array) -> tuple[int, int]:
    """Bins outside of which no head is and none attaches: the first, and the one behind the last; the others empty."""
    reach = _FARTHEST_WIDTHS * p[_W]
    first = max(0, int((-reach - shift - x0) / dx) - 1)
    last = min(n.size, int((reach - shift - x0) / dx) + 2)
    first, last = min(first, n.size), max(last, 0)
    for i in range(first):
        if n[i] > _NOBODY:
            first = i
            break
        n[i] = 0.0
    for i in range(n.size - 1, last - 1, -1):
        if n[i] > _NOBODY:
            last = i + 1
            break
        n[i] = 0.0
    return first, max(first, last)


@compiled
def _heads(
    n: Array, unit: Array, move: float, factor: float, h: float, x0: float, dx: float, p: Array, work: Array
) -> None:
    """Attachment and detachment over h at strains half-way through the step; updates heads, ready and torn heads."""
    shift = unit[OFFSET] + move
    slow, fast = p[_K11] * np.exp(-p[_K12] * shift), p[_K21] * np.exp(p[_K22] * shift)
    length = unit[LENGTH] + move
    f = p[_F] * factor * attachment(length, p)
    sites = unit[N_ON] * overlap(length, p)
    tears, q0 = p[_TK] > 0.0, unit[Q0]
    source = f * max(0.0, unit[DRX] * (sites - q0))
    rebound_rate = 0.0
    rebound = unit[TORN]
    half_q0, torn_rate = 0.0, 0.0
    norm = 1.0 / (p[_W] * np.sqrt(2.0 * np.pi))
    total_weight = 0.0
    first, last = _occupied(n, shift, x0, dx, p)
    # Rows of work: rate, exp(-rate h/2), attachment profile, tearing rate, tables of both exponentials.
    for i in range(first, last):
        x = x0 + i * dx + shift
        rate = slow * work[4, i] + fast * work[5, i]
        if p[_PI] > 0.0:
            rate += p[_PI] / (1.0 + np.exp(x / 0.15))
        if tears:
            work[3, i] = p[_TK] / (1.0 + np.exp(-p[_TS] * (x - p[_TX])))
            rate += work[3, i]
        y = x / p[_W]
        work[2, i] = norm * np.exp(-0.5 * y * y) if y * y < _FARTHEST_WIDTHS**2 else 0.0
        total_weight += work[2, i]
        work[0, i] = rate
        work[1, i] = np.exp(-0.5 * rate * h)
    total_weight *= dx
    if tears:
        for i in range(first, last):
            torn_rate += work[3, i] * n[i]
        torn_rate *= dx
        decay = np.exp(-0.5 * p[_TB] * h)
        rebound_rate = p[_TB] * (rebound * decay + torn_rate * (1.0 - decay) / p[_TB])
    for i in range(first, last):
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
    for i in range(first, last):
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


@compiled
def _weak(unit: Array, h: float, p: Array) -> None:
    """Weakly bound heads: as many as sites are active, let go the faster the more they are strained."""
    unit[WEAK_SITES] = unit[N_ON] + (unit[WEAK_SITES] - unit[N_ON]) * np.exp(-h / p[_WL])
    stiffness = p[_WK] * max(unit[WEAK_SITES], 1e-12)
    rate = p[_WR] * (1.0 + abs(unit[WEAK_FORCE]) / stiffness / p[_WX])
    unit[WEAK_FORCE] *= np.exp(-rate * h)


@compiled
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
        force += n[i] * head_force(z, p[_CURVE])
        stiffness += n[i] * head_stiffness(z, p[_CURVE])
    return dx * force, dx * stiffness


@compiled
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
    for _ in range(30):
        mean = 0.0
        compliance = 0.0
        for m in range(count):
            unit = units[m]
            force, stiffness = _linear(n[m], unit, moved[m], x0, dx, p)
            weak = p[_WK] * unit[WEAK_SITES]
            base = strength[m] * force + unit[WEAK_FORCE] + weak * moved[m]
            base += p[_UK] * (unit[LENGTH] + moved[m])
            # Ties pull back what lies beyond the mean length X, whose part is put in below.
            slope = strength[m] * stiffness + weak + p[_UK]
            line[m, 0], line[m, 1] = base, max(slope, 1e-12)
            mean += unit[LENGTH] + moved[m] - base / line[m, 1]
            compliance += 1.0 / line[m, 1]
        mean /= count
        compliance /= count
        # Each bears T = line + slope d - k X; their lengths' mean is X = free - series_length(T). In T this is rising
        # and concave, so Newton's steps cannot run away.
        loose = 1.0 - p[_UK] * compliance
        for _ in range(60):
            error = mean + compliance * tension + loose * (series_length(tension, p) - free)
            step = error / (compliance + loose * series_slope(tension, p))
            tension -= step
            if abs(step) < 1e-13 + 1e-12 * abs(tension):
                break
        largest = 0.0
        together = p[_UK] * (free - series_length(tension, p))
        for m in range(count):
            change = (tension + together - line[m, 0]) / line[m, 1]
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


@compiled
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


@compiled
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
        loose = 1.0 - p[_UK] * compliance
        units[m, LAST_MOVE] += extra / max(slope, 1e-12) / (compliance + loose * series_slope(shared[TENSION], p))


@compiled
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
            unit[N_ON] = thin(unit[N_ON], unit[Q0], calcium, switch_off, 0.5 * h, p)
            unit[DRX] = thick(unit[DRX], unit[Q0], unit[TORN], unit[FORCE], recruitment, 0.5 * h, p)
            _heads(n[m], unit, 0.5 * unit[LAST_MOVE], acting[k, ATTACHMENT], h, x0, dx, p, work)
            if p[_WK] > 0.0:
                _weak(unit, h, p)
        if p[_CC] > 0.0:
            target = p[_CC] * shared[TENSION]
            shared[CREPT] = target + (shared[CREPT] - target) * np.exp(-h / p[_CT])
        _balance(n, units, strength, shared, p[_GAMMA] * length[k + 1], x0, dx, p, line)
        for m in range(count):
            unit = units[m]
            unit[DRX] = thick(unit[DRX], unit[Q0], unit[TORN], unit[FORCE], recruitment, 0.5 * h, p)
            unit[N_ON] = thin(unit[N_ON], unit[Q0], calcium, switch_off, 0.5 * h, p)
        if (k + 1) % every == 0:
            row = (k + 1) // every - 1
            out[row, 0] = shared[TENSION]
            out[row, 1] = np.mean(units[:, N_ON])
            out[row, 2] = np.mean(units[:, Q0])


@compiled
def level(calcium: float, x0: float, dx: float, bins: int, p: Array, unit: Array, n: Array) -> None:
    """Isometric equilibrium of a half-sarcomere at rest length, reached from below as in activation from rest."""
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
        n_on = thin(n_on, q0, calcium, 1.0, 1e-3, p)
        q0_level = drx * n_on * bound / (1.0 + drx * bound)
        q0 += 0.3 * (q0_level - q0)
        drx = thick(drx, q0, 0.0, q0 / bound * pull, 0.0, 1e-3, p)
        if abs(n_on + q0 + drx - last) < 1e-12:
            break
    for i in range(bins):
        n[i] = weight[i] * q0 / bound
    unit[:] = 0.0
    unit[N_ON], unit[DRX], unit[Q0], unit[FORCE] = n_on, drx, q0, q0 / bound * pull
    unit[WEAK_SITES] = n_on
