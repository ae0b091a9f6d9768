"""Force clamp: a fibre under a load, which moves to the length at which it bears it.

Length moves linearly within a step, as in `Muscle.step`. The load is held at the samples; between them force is what
that movement makes of it. In the step in which a load begins the fibre thus gives way over the whole step: where that
matters, begin with steps as long as the apparatus takes to reach a load (0.1 ms, say).
"""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.inputs import check, check_limits, check_load, check_loads
from xb_muscle_ros.models.muscle import GUARD, Array, Muscle, Outputs

LIMITS_L0 = (-0.5, 0.5)
"""Length changes between which a load is borne, L0: half a fibre length either way, past which none does its work."""

# Begins what is said of a load.
_LOAD = "load of "
# Result codes of `stepping.clamp_kernels`; those below are of any step.
_TOO_WEAK, _TOO_STRONG, _NOT_HELD, _WEAK_TO_END, _STRONG_TO_END = 4, 5, 6, 7, 8


def clamp(
    muscle: Muscle,
    state: Array,
    load_f0: float,
    calcium_um: float,
    dt_s: float,
    limits_l0: tuple[float, float] = LIMITS_L0,
) -> Array:
    """State `dt_s` later, at the length at which the fibre bears the load; calcium is held.

    Force at the end is the load within 1e-9 F0, and within 1e-6 F0 where the length's last digit is more than that or
    where force jumps: where the step-size control of `Muscle.step` goes from one step to two lies their error. The new
    state is the one that `Muscle.step` gives for the length found, bit for bit. Only if it jumps by more than 2e-6 F0
    are smaller steps taken within, and `Muscle.step` then comes as near as its own error.

    Of several such lengths that one is taken which a fibre comes to first that bears too little at its length and
    lengthens, or too much and shortens; trials 0.002 L0 apart look for it. Of a slack spring under no load this is the
    least slack one. Past a peak of force a fibre is not carried on to where a passive element bears the load.

    Args:
        muscle: the fibre.
        state: shape (n,); a new one is returned.
        load_f0: force of the whole fibre, as `Outputs.force_f0`, F0.
        calcium_um: free calcium, µM.
        dt_s: duration, s.
        limits_l0: shortest and longest length change that the apparatus and the fibre allow, L0.

    Raises:
        UserError: a value out of range, no state of this fibre, or a load that no length on the way to the limit gives.
            A load above what the fibre bears lengthens it step by step until the limit is reached.
        StateViolation: see `Muscle.step`.
    """
    name = muscle.fibre.name
    check(name, 0.0, calcium_um, dt_s)
    check_load(name, load_f0)
    muscle.check_state(state)
    check_limits(name, *limits_l0, float(state[-3]))
    out = np.empty_like(state)
    code, fault, value, length, _, _ = muscle.code.clamp(
        state, float(load_f0), float(calcium_um), float(dt_s), *map(float, limits_l0), muscle.parameters, GUARD, out,
        _shown(), muscle.work,
    )  # fmt: skip
    if code != 0:
        if code < _TOO_WEAK:
            muscle.complain(code, fault, value, out)
        _complain(f"fibre {name}: {_LOAD}{load_f0:.6g} F0", code, value, length, limits_l0)
    return out


def clamp_run(
    muscle: Muscle,
    state: Array,
    dt_s: Array,
    load_f0: Array,
    calcium_um: Array,
    every: int = 1,
    counts: list[int] | None = None,
    limits_l0: tuple[float, float] = LIMITS_L0,
) -> Array:
    """States at every sample, shape (n, state): the result of `clamp` from sample to sample, bit for bit.

    Args:
        muscle: the fibre.
        state: at the first sample.
        dt_s: shape (n - 1,), time from each sample to the next, s.
        load_f0: shape (n,), F0; the k-th is borne at the k-th sample, the first by the state as it is.
        calcium_um: shape (n,), µM; the k-th acts in the step that ends at the k-th sample.
        every: stride of the samples whose states are returned, the first included.
        counts: the number of steps that were tried is added to it, then how often a step was halved to hold a load.
        limits_l0: see `clamp`.

    Raises:
        UserError: see `inputs.check_loads` and `clamp`; the time counts from the first sample.
        StateViolation: see `Muscle.step`.
    """
    name = muscle.fibre.name
    dt, load, calcium = (np.ascontiguousarray(a, dtype=np.float64) for a in (dt_s, load_f0, calcium_um))
    check_loads(name, dt, load, calcium)
    muscle.check_state(state, every)
    check_limits(name, *limits_l0, float(state[-3]))
    states = np.zeros(((load.size - 1) // every + 1, state.size))
    code, fault, value, length, steps, halvings, k = muscle.code.clamp_run(
        state, dt, load, calcium, *map(float, limits_l0), muscle.parameters, GUARD, every, states, _shown(), muscle.work
    )
    if code != 0:
        if code < _TOO_WEAK:
            muscle.complain(code, fault, float(dt[: k - 1].sum()) + value, states[-1])
        at = f"fibre {name}: {_LOAD}{load[k]:.6g} F0 at t = {dt[:k].sum():.6g} s"
        _complain(at, code, value, length, limits_l0)
    if counts is not None:
        counts += [steps, halvings]
    return states


def is_load_refused(text: str) -> bool:
    """Whether a message, perhaps of another process, says that a load is not borne; others are of states and inputs."""
    return _LOAD in text


def _shown() -> Array:
    return np.empty(len(Outputs._fields))


def _complain(load: str, code: int, force_f0: float, length_l0: float, limits_l0: tuple[float, float]) -> NoReturn:
    """Say why a load is not borne.

    Args:
        load: begins the message.
        code: result code of the compiled loops.
        force_f0, length_l0: the force nearest to the load that a length gave, F0, and that length change, L0; or the
            last one that a step led to.
        limits_l0: of the length change, L0.

    Raises:
        UserError: always.
    """
    shortest, longest = limits_l0
    end = f"{length_l0:.4g} L0, past which the model has no step"
    if code in (_TOO_WEAK, _WEAK_TO_END):
        to, where = (f"{longest:g} L0", f", at {length_l0:.4g} L0") if code == _TOO_WEAK else (end, "")
        raise UserError(
            f"{load} is more than the fibre bears at any length change from its own up to {to}: the most is "
            f"{force_f0:.4g} F0{where}; give a smaller load, more calcium or less time between samples"
        )
    if code in (_TOO_STRONG, _STRONG_TO_END):
        to, where = (f"{shortest:g} L0", f", at {length_l0:.4g} L0") if code == _TOO_STRONG else (end, "")
        raise UserError(
            f"{load} is less than the fibre bears at any length change from its own down to {to}: the least is "
            f"{force_f0:.4g} F0{where}; give a larger load or less time"
        )
    raise UserError(
        f"{load} lies where force jumps: the nearest is {force_f0:.9g} F0, at a length change of {length_l0:.6g} L0; "
        "take less time between samples"
    )
