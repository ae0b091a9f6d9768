"""Isotonic steps: the length for which a step ends at a given force. Compiled beside `kernels`, calling its `advance`.

A step is a function of the length at its end; the load is a root of the force there. Of several roots that one counts
which a fibre comes to first that bears too little and lengthens, or too much and shortens.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Of `stepping.kernels` and of the model.
OK = 0
advance: Callable[..., Any]
outputs: Callable[[Array, Array, Array], None]


# BEGIN COMPILED
TOO_WEAK, TOO_STRONG, NOT_HELD = 4, 5, 6
# The same as the first two, where not a limit but a length that no step reaches ends the search.
WEAK_TO_END, STRONG_TO_END = 7, 8
# Forces end within this of the load, F0, above it: of a spring that has gone slack the least stretched is the one that
# has just not.
HELD = 1e-9
# Where no length comes nearer: a last digit of it is more force than that, or the force of one step and of two differ.
NEARLY_HELD = 1e-6
# What a fibre's stiffness is like, F0/L0: where the second trial lies.
LIKELY_STIFFNESS = 100.0
# So far apart trials may be until the load lies between two, L0: force has a peak within a step, some 0.02 L0 wide,
# and a slack part, and the load may be met beyond them again.
STRIDE = 2e-3
# Beside those strides.
MOST_TRIALS = 500
# How often the first step within is halved where force jumps over the load by more than that.
MOST_HALVINGS = 6


def clamp(
    s: Array, load: float, calcium: float, dt: float, shortest: float, longest: float, p: Array, tol: float,
    out: Array, shown: Array, work: Array,
) -> Any:  # fmt: skip
    """Carry a state over `dt` seconds to the length at which its force is the load, moving linearly to it.

    The search starts where the last velocity leads to, or a stride from the length that the fibre has; that length is
    the second trial where the load seems to lie farther away. It goes on by secants, outwards by no more than a stride
    until the load is bracketed, and falls back on halving. Lengths that no step reaches bound it as the limits do.

    Args:
        s: state vector, shape (n,).
        load: force of the fibre at the end, F0.
        calcium: free calcium, µM, held.
        dt: duration, s.
        shortest, longest: limits of the length change, L0.
        p: parameter vector.
        tol: see `advance`.
        out: receives the new state vector, which is what `advance` makes of the length found.
        shown: receives the outputs, shape (outputs,).
        work: scratch, shape (14, n).

    Returns:
        (code, index of the state at fault or -1, time reached in s or, where no length was found, the force in F0
        nearest to the load, length of that one in L0 or, where a failing step ended the search, of the last step that
        did not, steps of the model tried, halvings of the step within)
    """
    n = s.shape[0]
    aim = load + 0.5 * HELD
    start = s[n - 3]
    x = start + min(max(s[n - 2] * dt, -STRIDE), STRIDE)
    if not shortest < x < longest:
        x = start
    # Ends of the search: lengths there give too little and too much force, once there are any.
    below = -math.inf
    above = math.inf
    low = 0.0
    high = 0.0
    # The last two lengths that a step reached, and how far their forces are above the load.
    last = math.nan
    excess = math.nan
    before = math.nan
    excess_before = math.nan
    nearest = math.inf
    nearest_force = math.nan
    nearest_at = math.nan
    width = math.inf
    since = 0
    stubborn = 0
    h = dt
    halvings = 0
    steps = 0
    settled = False
    ended = False
    asked = False
    for _ in range(MOST_TRIALS + int((longest - shortest) / STRIDE)):
        code, fault, t, _, _, tried = advance(s, x, calcium, dt, p, h, tol, out, work)
        steps += tried
        g = math.nan
        if code == OK:
            outputs(out, p, shown)
            g = shown[0] - aim
        if math.isfinite(g):
            if settled or abs(g) < 0.4 * HELD:
                return OK, -1, dt, x, steps, halvings
            before = last
            excess_before = excess
            last = x
            excess = g
            if abs(g) < abs(nearest):
                nearest = g
                nearest_force = shown[0]
                nearest_at = x
            if g < 0.0:
                below = x
                low = g
            else:
                above = x
                high = g
        elif math.isnan(last):
            # Not even a first step: one at rest may do, and if not, the length is not to blame.
            if x == start or code == OK:
                return max(code, 1), fault, t, x, steps, halvings
            x = start
            continue
        else:
            if x > last:
                longest = x
            else:
                shortest = x
            ended = True
            x = 0.5 * (x + last)
            if abs(x - last) >= 1e-6:
                continue
            return (WEAK_TO_END if excess < 0.0 else STRONG_TO_END), -1, nearest_force, last, steps, halvings
        if asked:
            asked = False
            if (excess < 0.0) == (excess_before < 0.0):
                # It does: the search goes on from the trial beyond.
                last, before = before, last
                excess, excess_before = excess_before, excess
            else:
                # It does not: force falls from there to the trial beyond, and the way is the other one.
                below = last if excess < 0.0 else -math.inf
                above = math.inf if excess < 0.0 else last
                before = math.nan
        elif math.isnan(before) and last != start and (excess < 0.0) == (last > start):
            # Farther away, by the first trial; what the fibre bears at its own length is to say so too.
            asked = True
            x = start
            continue
        slope = (excess - excess_before) / (last - before)
        if math.isinf(below) or math.isinf(above):
            # Outwards by secants that may overshoot; where force does not rise with length, by strides.
            reach = abs(last - before)
            if math.isnan(reach):
                move = min(abs(excess) / LIKELY_STIFFNESS, STRIDE)
            elif slope > 0.0:
                move = min(abs(excess) / slope, 8.0 * reach, STRIDE)
            else:
                move = STRIDE
            # By no less than what changes the length at all.
            move = math.copysign(max(move, 1e-15 * max(1.0, abs(last))), -excess)
            bound = longest if move > 0.0 else shortest
            room = math.copysign(1.0, move) * (bound - last)
            if room < 1e-6:
                if ended:
                    return (WEAK_TO_END if excess < 0.0 else STRONG_TO_END), -1, nearest_force, last, steps, halvings
                return (TOO_WEAK if excess < 0.0 else TOO_STRONG), -1, nearest_force, nearest_at, steps, halvings
            x = last + move if abs(move) < room else 0.5 * (last + bound)
            continue
        x = last - excess / slope
        since += 1
        if since == 3:
            # Three secants have to halve the interval; where they twice did not, halving goes on alone.
            since = 0
            if not above - below < 0.5 * width:
                x = math.nan
                stubborn += 1
            width = above - below
        if stubborn > 2 or not below < x < above:
            x = below + 0.5 * (above - below)
        if below < x < above:
            continue
        # Nothing lies between the two.
        settled = min(-low, high) <= NEARLY_HELD
        if settled:
            x = below if -low < high else above
        elif halvings < MOST_HALVINGS:
            halvings += 1
            h *= 0.5
            x = below
            below = -math.inf
            above = math.inf
            last = math.nan
            before = math.nan
            width = math.inf
            stubborn = 0
        else:
            break
    return NOT_HELD, -1, nearest_force, nearest_at, steps, halvings


def clamp_run(
    s: Array, dt_s: Array, load: Array, calcium: Array, shortest: float, longest: float, p: Array, tol: float,
    every: int, out: Array, shown: Array, work: Array,
) -> Any:  # fmt: skip
    """Follow samples of load and calcium; `out[k]` is the state at sample k * every, `out[0]` is `s`.

    Args:
        s: state at the first sample.
        dt_s: shape (samples - 1,), time from each sample to the next, s.
        load, calcium: shape (samples,), F0, µM; the k-th acts in the step that ends at sample k.
        shortest, longest, p, tol, shown, work: see `clamp`.
        every: stride of the samples to keep.
        out: receives states, shape ((samples - 1) // every + 1, n); on failure its last row is the offending one.

    Returns:
        what `clamp` returns for the last step, with sums of its counts, and the sample reached
    """
    here = work[2]
    there = work[3]
    n = s.shape[0]
    samples = load.shape[0]
    for i in range(n):
        here[i] = s[i]
        out[0, i] = s[i]
    steps = 0
    halvings = 0
    for k in range(1, samples):
        code, fault, t, length, tried, halved = clamp(
            here, load[k], calcium[k], dt_s[k - 1], shortest, longest, p, tol, there, shown, work
        )
        steps += tried
        halvings += halved
        for i in range(n):
            here[i] = there[i]
        if code != OK:
            for i in range(n):
                out[out.shape[0] - 1, i] = here[i]
            return code, fault, t, length, steps, halvings, k
        if k % every == 0:
            for i in range(n):
                out[k // every, i] = here[i]
    return OK, -1, 0.0, 0.0, steps, halvings, samples - 1
