"""A fibre ready to step: the one `step` that node, replay, fit and diagnosis share."""

from __future__ import annotations

import functools
import math
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.compiled import compiled
from xb_muscle_ros.models.composition import Outputs as Outputs
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.inputs import check, check_samples, check_states
from xb_muscle_ros.models.registry import compose, model_of_set

Array = npt.NDArray[np.float64]

# The fixed stepper's guard: an embedded error of 1e-4 is 0.02 % of F0; smooth input at 1 ms stays 100 times below it.
GUARD = 1e-4
SCRATCH_ROWS = 14  # four for the loops, the others for a model's step
_LONGEST_SETTLING_S = 1e6
_ON_THE_WAY = 1e-4  # embedded error of the steps on the way to rest

_DOUBLE = np.dtype(np.float64)
_WARM: set[Any] = set()  # compiled modules that have taken a step in this process

_REMEDIES = (  # by result code of the compiled loops
    "",
    "check the input for jumps and the parameters for extremes, or take a smaller step",
    "check the parameters, or take a smaller step",
    "the equations are stiffer than the tolerance allows; loosen it or check the parameters",
)


class Muscle:
    """One fibre, one model, one method, compiled.

    A state is a vector of shape (n,): the integrated states, then length change (L0), velocity (L0/s) and calcium (µM)
    of the last step. All methods are pure: they return new states and keep nothing.

    Attributes:
        fibre: values and constants.
        parameters: parameter vector in the order of the model's table, read-only.

    Source:
        equations and their solution: docs/model.md, after van der Zee et al. 2026.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> muscle = xb.Muscle(xb.load_fibre("18Dec2017a"))
        >>> state = muscle.settle(0.0, 0.8)  # length change in L0, free calcium in µM
        >>> state = muscle.step(state, 0.001, 0.8, 1e-3)  # 1 ms later
        >>> round(muscle.outputs(state).force_f0, 2)  # F0
        0.55
    """

    def __init__(self, fibre: Fibre) -> None:
        """Load the fibre's compiled model, generating and compiling it on the first use on a machine (seconds).

        Raises:
            UserError: unknown model or method, or nowhere to keep compiled code.
        """
        self.fibre = fibre
        model = model_of_set(fibre.model)
        composition = compose(model, fibre.method)
        self.code: Any = compiled(model, fibre.method, fibre.values["smoothing"] > 0.0)
        self.parameters: Array = self.code.prepare(np.array([fibre.values[row.name] for row in composition.parameters]))
        self.parameters.setflags(write=False)
        self._settling = composition.settling
        self._states = composition.state_rows(fibre.values)
        self._n = len(self._states) + 3
        self._shape = (self._n,)
        self._out = np.zeros(len(Outputs._fields))
        if self.code not in _WARM:
            # One short step now, so that the first real one finds everything compiled.
            self.outputs(self.step(self.rest(), 0.0, 0.1, 1e-6))
            _WARM.add(self.code)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickled and copied by its fibre; compiled code is found anew."""
        return type(self), (self.fibre,)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the entries of a state vector."""
        return (*(s.name for s in self._states), "length_change", "velocity", "calcium")

    @functools.cached_property
    def work(self) -> Array:
        """Scratch for the compiled loops; one of a batch's fibres never needs its own."""
        return np.zeros((SCRATCH_ROWS, self._n))

    def rest(self, length_change_l0: float = 0.0) -> Array:
        """State of a fibre at rest without calcium, at a length change in L0.

        Raises:
            UserError: no fibre has this length.
        """
        check(self.fibre.name, length_change_l0, 0.0)
        state = np.zeros(self._n)
        self.code.rest(self.parameters, state)
        state[-3] = length_change_l0
        return state

    def settle(self, length_change_l0: float, calcium_um: float, duration_s: float | None = None) -> Array:
        """State after isometric activation from rest.

        Args:
            length_change_l0: length change relative to rest, L0.
            calcium_um: free calcium, µM.
            duration_s: how long; None: until no state changes by more than 1e-9 1/s (1e-6 on a strain grid), which
                takes minutes of muscle time at low calcium and milliseconds of computing (seconds on a large grid).

        Raises:
            UserError: length, calcium or duration out of range, or the fibre does not come to rest at this calcium.
            StateViolation: a state left its bounds.
        """
        check(self.fibre.name, length_change_l0, calcium_um, 1.0 if duration_s is None else duration_s)
        state = self.rest(length_change_l0)
        if duration_s is not None:
            return self.hold(state, calcium_um, duration_s)
        rates = np.zeros(self._n - 3)
        if (quick := self._settled_quickly(state, calcium_um, rates)) is not None:
            return quick
        chunk, total = 1.0, 0.0
        # Fixed steps cost time by the second of muscle time, variable ones hardly any.
        longest, end = (_LONGEST_SETTLING_S, _LONGEST_SETTLING_S) if self._settling.step_s is None else (4.0, 1000.0)
        while total < end:
            state = self.hold(state, calcium_um, chunk)
            total += chunk
            self.code.slope(state, 0.0, calcium_um, self.parameters, rates)
            if np.max(np.abs(rates), initial=0.0) < self._settling.rate:
                return state
            chunk = min(2.0 * chunk, longest)
        raise UserError(
            f"fibre {self.fibre.name}, model {self.fibre.model}: not at rest after {total:.3g} s at {calcium_um:g} µM "
            f"calcium (fastest state still changes by {np.max(np.abs(rates)):.3g} 1/s); give a settling time instead"
        )

    def _settled_quickly(self, state: Array, calcium_um: float, rates: Array) -> Array | None:
        """The state of rest by steps that need not be right on the way; None where they do not end at rest.

        An L-stable method forgets the way it came: at rest its steps are Newton's. Smooth functions have states of rest
        besides the fibre's own, with hardly a head attached, which such steps may end in.
        """
        if self._settling.step_s is not None or self.fibre.values["smoothing"] > 0.0:
            return None
        # A step that is a tiny share of what is to come counts as stuck, so the first second goes by itself, if need be
        # the first millisecond too (passive force, hardly a head). What a long step leaves of an error one more takes.
        steps = ((1.0, 1e-6), (_LONGEST_SETTLING_S, 0.1), (_LONGEST_SETTLING_S, _LONGEST_SETTLING_S))
        for durations in (steps, ((1e-3, 1e-6), *steps)):
            found = state
            try:
                for dt, h in durations:
                    found = self._advance(found, float(state[-3]), calcium_um, dt, h, _ON_THE_WAY)
            except UserError:
                continue
            self.code.slope(found, 0.0, calcium_um, self.parameters, rates)
            inside = self.code.violation(found, self.parameters, 1e-9) < 0
            if inside and np.max(np.abs(rates), initial=0.0) < self._settling.rate:
                return found
        return None

    def step(self, state: Array, length_change_l0: float, calcium_um: float, dt_s: float) -> Array:
        """State `dt_s` later: length moves linearly to `length_change_l0` (L0), calcium (µM) is held.

        One step of an L-stable method; where its own error estimate exceeds 1e-4 or a state would leave its bounds,
        the step is halved as often as needed, so that the result holds for any input. Nothing is clipped.

        Raises:
            UserError: length, calcium or duration out of range, or no state of this fibre.
            StateViolation: no step size leads to an allowed state; names fibre, state and time within the step.
        """
        check(self.fibre.name, length_change_l0, calcium_um, dt_s)
        self.check_state(state)
        return self._advance(state, length_change_l0, calcium_um, dt_s, dt_s, GUARD)

    def outputs(self, state: Array) -> Outputs:
        """Forces, contractile element and distribution at a state.

        Raises:
            UserError: no state of this fibre.
        """
        self.check_state(state)
        self.code.outputs(state, self.parameters, self._out)
        return Outputs(*self._out.tolist())

    def outputs_of(self, states: Array) -> dict[str, Array]:
        """The same for many states, shape (n, state): arrays of shape (n,) by name of `Outputs`.

        Raises:
            UserError: no states of this fibre.
        """
        check_states(states, len(states), self._n)
        table = np.zeros((states.shape[0], len(Outputs._fields)))
        self.code.outputs_of(states, self.parameters, table)
        return {name: table[:, i].copy() for i, name in enumerate(Outputs._fields)}

    def run(
        self,
        state: Array,
        dt_s: Array,
        length_change_l0: Array,
        calcium_um: Array,
        substeps: int = 1,
        every: int = 1,
        counts: list[int] | None = None,
        begin_s: float = 0.0,
    ) -> Array:
        """States at every sample, shape (n, state): the result of `step` from sample to sample, bit for bit.

        Args:
            state: at the first sample.
            dt_s: shape (n - 1,), time from each sample to the next, s.
            length_change_l0: shape (n,), L0.
            calcium_um: shape (n,), µM; the k-th acts in the step that ends at the k-th sample.
            substeps: steps between two samples.
            every: stride of the samples whose states are returned, the first included.
            counts: the number of steps that were tried is added to it.
            begin_s: time of the first sample, s, where a fault is told.

        Raises:
            UserError: see `inputs.check_samples` and `check_state`.
            StateViolation: see `step`; the time counts from the first sample.
        """
        self.check_state(state, every)
        states = np.zeros(((length_change_l0.size - 1) // every + 1, self._n))
        arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (dt_s, length_change_l0, calcium_um)]
        check_samples(self.fibre.name, arrays[0], arrays[1], arrays[2])
        code, fault, k, within, steps = self.code.run(
            state, *arrays, self.parameters, GUARD, substeps, every, states, self.work
        )
        if code != 0:
            self.complain(code, fault, begin_s + float(arrays[0][: k - 1].sum() + within), states[-1])
        if counts is not None:
            counts.append(steps)
        return states

    def follow(
        self,
        state: Array,
        corner_s: Array,
        length_change_l0: Array,
        calcium_um: Array,
        sample_s: Array,
        tolerance: float = 1e-6,
        counts: list[int] | None = None,
    ) -> Array:
        """States at the samples by variable steps that land on every corner of the input.

        Args:
            state: at the first corner.
            corner_s: shape (m,), ascending, s.
            length_change_l0: shape (m,), L0; linear between corners.
            calcium_um: shape (m,), µM; the k-th acts up to the k-th corner.
            sample_s: shape (n,), ascending, within the corners, s.
            tolerance: error of one step in units of the states (1e-6: about 1e-7 F0).
            counts: see `run`.

        Raises:
            UserError: see `inputs.check_samples` and `check_state`.
            StateViolation: see `step`.
        """
        self.check_state(state)
        states = np.zeros((sample_s.size, self._n))
        arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (corner_s, length_change_l0, calcium_um, sample_s)]
        check_samples(self.fibre.name, np.diff(arrays[0]), arrays[1], arrays[2])
        code, fault, t, steps, _ = self.code.follow(state, *arrays, self.parameters, 1e-4, tolerance, states, self.work)
        if code != 0:
            self.complain(code, fault, t, self.work[1])
        if counts is not None:
            counts.append(steps)
        return states

    def hold(self, state: Array, calcium_um: float, duration_s: float) -> Array:
        """State after `duration_s` at the state's own length with calcium (µM) held, by the method's best steps.

        Raises:
            UserError: no state of this fibre.
            StateViolation: see `step`.
        """
        self.check_state(state)
        length = float(state[-3])
        step_s = self._settling.step_s
        if step_s is None:
            return self._advance(state, length, calcium_um, duration_s, 1e-6, self._settling.tolerance)
        count = max(1, math.ceil(duration_s / step_s - 1e-9))
        dt = np.full(count, duration_s / count)
        held = np.full(count + 1, calcium_um)
        after: Array = self.run(state, dt, np.full(count + 1, length), held, every=count)[-1]
        return after

    def _advance(self, state: Array, length: float, calcium: float, dt: float, h: float, tolerance: float) -> Array:
        out = np.empty(self._n)
        code, fault, t, _, _, _ = self.code.advance(
            state, length, calcium, dt, self.parameters, h, tolerance, out, self.work
        )
        if code != 0:
            self.complain(code, fault, t, out)
        return out

    def check_state(self, state: Array, every: int = 1) -> None:
        """See whether compiled loops may be given a state, which they take as it is; some 0.1 µs.

        Args:
            every: stride of the samples whose states are asked for.

        Raises:
            UserError: it is of another model, no array of 64-bit numbers, or the stride is below 1.
        """
        if not isinstance(state, np.ndarray) or state.shape != self._shape or state.dtype != _DOUBLE:
            found = f"{getattr(state, 'dtype', type(state).__name__)} of shape {getattr(state, 'shape', '?')}"
            raise UserError(
                f"fibre {self.fibre.name}, model {self.fibre.model}: a state is float64 of shape ({self._n},), not "
                f"{found}; take it from settle, rest, step or run of this model"
            )
        if every < 1:
            raise UserError(f"fibre {self.fibre.name}: every is {every}; allowed is 1 and above")

    def complain(self, code: int, fault: int, time_s: float, state: Array) -> NoReturn:
        """Raise what a result code of the compiled loops means.

        Raises:
            StateViolation: a state is at fault.
            UserError: the step size is.
        """
        remedy = _REMEDIES[code]
        if fault < 0:
            raise UserError(f"fibre {self.fibre.name}: integration stopped at t = {time_s:.6g} s; {remedy}")
        name = self._states[fault].name
        lower, upper = self._states[fault].lower, self._states[fault].upper
        raise StateViolation(self.fibre.name, name, time_s, float(state[fault]), f"{lower:g} to {upper:g}", remedy)
