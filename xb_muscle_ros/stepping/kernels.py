"""Loops around one Rosenbrock step. Their text is compiled anew beside each model's own step: see `models.codegen`.

Nothing here knows a model: `attempt`, `regrid`, `slope`, `outputs` and `violation` stand for the generated ones. All
functions are pure: they read the state they are given and write to `out` and `work` only.

A state vector holds the integrated states, then length change (L0), velocity (L0/s) and calcium (µM). Of the
scratch `work`, rows 0 to 3 belong to these loops, the others to the model.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import get_thread_id, prange

Array = npt.NDArray[np.float64]

OK, NOT_FINITE, OUT_OF_BOUNDS, TOO_MANY_STEPS = 0, 1, 2, 3
MAX_ATTEMPTS = 20000
# One over the order of the method: how the step size follows the error.
EXPONENT = 1.0 / 3.0
# An error this small against the tolerance lets the next step be five times as long: (0.9/5) ** order.
SMALL_ERROR = (0.9 / 5.0) ** 3

# One step of h seconds into `out`; returns the largest embedded error: (s, h, velocity, calcium, p, out, work).
attempt: Callable[[Array, float, float, float, Array, Array, Array], float]
# After an accepted step: bring a strain grid back to where heads attach; moments need nothing: (s, p, work).
regrid: Callable[[Array, Array, Array], None]
# Rates of change of the integrated states: (s, velocity, calcium, p, out).
slope: Callable[[Array, float, float, Array, Array], None]
# Forces, contractile element and states: (s, p, out).
outputs: Callable[[Array, Array, Array], None]
# Index of the first state that is not finite or out of its bounds by more than the slack, else -1: (s, p, slack).
violation: Callable[[Array, Array, float], int]


# Whether states between steps are interpolated. A stiff strain bin's slope at the end of a step is what is left of its
# error times its rate: too much to interpolate with, so steps on grids land on the samples.
INTERPOLATED = True


# BEGIN COMPILED
def growth(error: float, tol: float) -> float:
    """How much longer the next step may be after one whose error is within the tolerance: 0.9 to 5."""
    # The power costs a tenth of a step, and with fixed steps the error hardly ever comes near the tolerance.
    if error <= SMALL_ERROR * tol:
        return 5.0
    return 0.9 * math.pow(tol / error, EXPONENT)


def shrinkage(error: float, tol: float) -> float:
    """How much shorter a step has to be after one whose error is beyond the tolerance: 0.1 to 0.7."""
    if not error < 1e300:
        return 0.25
    return min(0.7, max(0.1, 0.9 * math.pow(tol / error, EXPONENT)))


def advance(
    s: Array, length_end: float, calcium: float, dt: float, p: Array, h: float, tol: float, out: Array, work: Array
) -> Any:
    """Carry a state over `dt` seconds, in one step of `h` or in as many as the tolerance asks for.

    A step is taken again at a smaller size when its embedded error exceeds `tol` or its result leaves the states'
    bounds; it is never mended. With `h = dt` this is the fixed stepper, whose tolerance is a guard; with the `h` of
    the last call it is the variable one.

    Args:
        s: state vector, shape (n,).
        length_end: length change at the end, L0; it moves linearly from the state's own.
        calcium: free calcium, µM, held.
        dt: duration, s.
        p: parameter vector.
        h: first step to try, s.
        tol: largest embedded error of a step, in units of the states.
        out: receives the new state vector; on failure the offending one.
        work: scratch, shape (14, n).

    Returns:
        (code, index of the state at fault or -1, time reached in s, next step to try in s, steps taken, steps tried)
    """
    n = s.shape[0]
    velocity = (length_end - s[n - 3]) / dt
    slack = max(10.0 * tol, 1e-9)
    tried = 0
    if h >= dt:
        # Nearly every fixed step ends here: one attempt, straight into `out`.
        h = dt
        tried = 1
        error = attempt(s, h, velocity, calcium, p, out, work)
        fault = violation(out, p, slack)
        if fault < 0 and error <= tol:
            out[n - 3] = length_end
            out[n - 2] = velocity
            out[n - 1] = calcium
            regrid(out, p, work)
            return OK, -1, dt, h * max(1.0, growth(error, tol)), 1, tried
        h = h * (0.25 if fault >= 0 else shrinkage(error, tol))
    here = work[0]
    trial = work[1]
    for i in range(n):
        here[i] = s[i]
    t = 0.0
    next_h = h
    taken = 0
    code = OK
    fault = -1
    while t < dt:
        if tried >= MAX_ATTEMPTS:
            code = TOO_MANY_STEPS
            break
        tried += 1
        rest = dt - t
        # Stretch the last step rather than leave a sliver behind.
        if h > rest * 0.999999:
            h = rest
        error = attempt(here, h, velocity, calcium, p, trial, work)
        fault = violation(trial, p, slack)
        if fault < 0 and error <= tol:
            taken += 1
            t = dt if h == rest else t + h
            for i in range(n - 3):
                here[i] = trial[i]
            here[n - 3] = s[n - 3] + velocity * t
            regrid(here, p, work)
            grown = h * growth(error, tol)
            # A step cut short by the end of the interval says little about the next one.
            next_h = max(grown, next_h) if h == rest else grown
            h = grown
        else:
            h = h * (0.25 if fault >= 0 else shrinkage(error, tol))
            next_h = h
            if h < 1e-12 * dt or h < 1e-15:
                code = OUT_OF_BOUNDS if fault >= 0 and np.isfinite(trial[fault]) else NOT_FINITE
                for i in range(n - 3):
                    here[i] = trial[i]
                break
    for i in range(n - 3):
        out[i] = here[i]
    out[n - 3] = length_end
    out[n - 2] = velocity
    out[n - 1] = calcium
    return code, fault, t, next_h, taken, tried


def run(
    s: Array, dt_s: Array, length: Array, calcium: Array, p: Array, tol: float, substeps: int,
    every: int, out: Array, work: Array,
) -> Any:  # fmt: skip
    """Follow samples of length and calcium; `out[k]` is the state at sample k * every, `out[0]` is `s`.

    Args:
        s: state at the first sample.
        dt_s: shape (samples - 1,), time from each sample to the next, s.
        length, calcium: shape (samples,), L0, µM; calcium[k] acts in the step that ends at sample k.
        substeps: fixed steps between two samples.
        every: stride of the samples to keep.
        out: receives states, shape ((samples - 1) // every + 1, n); on failure its last row is the offending one.
        work: scratch, shape (14, n).

    Returns:
        (code, index of the state at fault, index of the sample reached, time within the step in s, steps tried)
    """
    here = work[2]
    there = work[3]
    n = s.shape[0]
    samples = length.shape[0]
    for i in range(n):
        here[i] = s[i]
        out[0, i] = s[i]
    steps = 0
    for k in range(1, samples):
        dt = dt_s[k - 1] / substeps
        start = length[k - 1]
        rise = length[k] - start
        for j in range(substeps):
            end = length[k] if j == substeps - 1 else start + rise * ((j + 1) / substeps)
            code, fault, t, _, _, tried = advance(here, end, calcium[k], dt, p, dt, tol, there, work)
            steps += tried
            for i in range(n):
                here[i] = there[i]
            if code != OK:
                for i in range(n):
                    out[out.shape[0] - 1, i] = here[i]
                return code, fault, k, j * dt + t, steps
        if k % every == 0:
            for i in range(n):
                out[k // every, i] = here[i]
    return OK, -1, samples - 1, 0.0, steps


def follow(
    s: Array, corner: Array, length: Array, calcium: Array, sample: Array, p: Array, first_h: float, tol: float,
    out: Array, work: Array,
) -> Any:  # fmt: skip
    """Variable steps between the corners of a protocol, landing on each.

    Samples are interpolated (cubic, order 3) or, on strain grids, landed on as well.

    Args:
        s: state at corner[0].
        corner, length, calcium: shape (m,), s, L0, µM; length is linear between corners, calcium[k] acts up to
            corner k.
        sample: ascending times within the corners, s, shape (samples,).
        first_h: step to try first, s; it is carried over the corners, where the error control finds the new one.
        out: receives states at the samples, shape (samples, n).
        work: scratch, shape (14, n).

    Returns:
        (code, index of the state at fault, time reached in s, steps tried, steps taken)
    """
    n = s.shape[0]
    here = work[0]
    there = work[1]
    before = work[2]
    after = work[3]
    for i in range(n):
        here[i] = s[i]
    samples = sample.shape[0]
    next_sample = 0
    while next_sample < samples and sample[next_sample] <= corner[0]:
        for i in range(n):
            out[next_sample, i] = here[i]
        next_sample += 1
    slack = max(10.0 * tol, 1e-9)
    tried = 0
    taken = 0
    h = first_h
    for k in range(1, corner.shape[0]):
        begin = corner[k - 1]
        dt = corner[k] - begin
        velocity = (length[k] - length[k - 1]) / dt
        t = 0.0
        in_interval = 0
        here[n - 3] = length[k - 1]
        while t < dt:
            stop = dt
            if not INTERPOLATED and next_sample < samples and sample[next_sample] - begin < dt:
                stop = sample[next_sample] - begin
            rest = stop - t
            wanted = h
            if h > rest * 0.999999:
                h = rest
            elif h > 0.5 * rest:
                h = 0.5 * rest
            if in_interval >= MAX_ATTEMPTS:
                return TOO_MANY_STEPS, -1, begin + t, tried, taken
            in_interval += 1
            tried += 1
            error = attempt(here, h, velocity, calcium[k], p, there, work)
            fault = violation(there, p, slack)
            if fault >= 0 or not error <= tol:
                h = h * (0.25 if fault >= 0 else shrinkage(error, tol))
                if h < 1e-15 or h < 1e-12 * dt:
                    for i in range(n - 3):
                        out[min(next_sample, samples - 1), i] = there[i]
                    code = OUT_OF_BOUNDS if fault >= 0 and np.isfinite(there[fault]) else NOT_FINITE
                    return code, fault, begin + t, tried, taken
                continue
            taken += 1
            landed = h == rest
            end = stop if landed else t + h
            until = next_sample
            while until < samples and (
                sample[until] - begin < end
                or (landed and (sample[until] - begin == end or (end == dt and sample[until] <= corner[k])))
            ):
                until += 1
            if INTERPOLATED and until > next_sample:
                there[n - 3] = length[k - 1] + velocity * (t + h)
                slope(here, velocity, calcium[k], p, before)
                slope(there, velocity, calcium[k], p, after)
            for j in range(next_sample, until):
                x = (sample[j] - begin - t) / h
                if INTERPOLATED:
                    a = (1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x)
                    b = x * (1.0 - x) * (1.0 - x) * h
                    c = x * x * (3.0 - 2.0 * x)
                    d = x * x * (x - 1.0) * h
                    for i in range(n - 3):
                        out[j, i] = a * here[i] + b * before[i] + c * there[i] + d * after[i]
                else:
                    for i in range(n - 3):
                        out[j, i] = there[i]
                out[j, n - 3] = length[k - 1] + velocity * (t + x * h)
                out[j, n - 2] = velocity
                out[j, n - 1] = calcium[k]
            next_sample = until
            for i in range(n - 3):
                here[i] = there[i]
            regrid(here, p, work)
            t = end
            here[n - 3] = length[k - 1] + velocity * t
            grown = h * growth(error, tol)
            # A step cut short by a corner or a sample says little about the next one.
            h = max(grown, wanted) if landed else grown
    return OK, -1, corner[corner.shape[0] - 1], tried, taken


def outputs_of(states: Array, p: Array, table: Array) -> None:
    """Outputs of many states, one row each."""
    for k in range(states.shape[0]):
        outputs(states[k], p, table[k])


# PARALLEL
def advance_many(
    s: Array, length_end: Array, calcium: Array, dt: float, p: Array, tol: float, out: Array, work: Array,
    report: Array, table: Array,
) -> int:  # fmt: skip
    """One fixed step of `dt` for many fibres, spread over the cores; each is what `advance` makes of it, to the bit.

    Args:
        s: states, shape (fibres, n).
        length_end, calcium: shape (fibres,), L0 and µM.
        p: parameter vectors, shape (fibres, parameters).
        out: receives states, shape (fibres, n).
        work: scratch, shape (threads, 13, n).
        report: receives code, index of the state at fault and time reached in s, shape (fibres, 3).
        table: receives outputs at the new states, a row each, or has no rows.

    Returns:
        how many fibres failed.
    """
    failed = 0
    wanted = table.shape[0] > 0
    for k in prange(s.shape[0]):
        scratch = work[get_thread_id()]
        code, fault, t, _, _, _ = advance(s[k], length_end[k], calcium[k], dt, p[k], dt, tol, out[k], scratch)
        report[k, 0] = code
        report[k, 1] = fault
        report[k, 2] = t
        if code != OK:
            failed += 1
        elif wanted:
            outputs(out[k], p[k], table[k])
    return failed


# PARALLEL
def outputs_many(states: Array, p: Array, table: Array) -> None:
    """Outputs of one state of each of many fibres, one row each."""
    for k in prange(states.shape[0]):
        outputs(states[k], p[k], table[k])
