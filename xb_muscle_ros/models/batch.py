"""Many fibres in one compiled call, each with its own parameters: the way into controllers and other simulators."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numba
import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.inputs import check_many, check_states
from xb_muscle_ros.models.muscle import GUARD, SCRATCH_ROWS, Array, Muscle, Outputs

_NO_TABLE = np.empty((0, len(Outputs._fields)))


class MuscleBatch:
    """Fibres of one model and one method, stepped together on all cores.

    Every fibre's result is that of `Muscle.step`, bit for bit. All methods are pure.

    Attributes:
        muscles: one for each fibre, in order.
        state_names: see `Muscle`.

    Source:
        see `Muscle`.

    Examples:
        >>> import numpy as np, xb_muscle_ros as xb
        >>> batch = xb.MuscleBatch([xb.load_fibre("18Dec2017a"), xb.load_fibre("13Dec2017a")])
        >>> states = batch.settle(np.zeros(2), np.full(2, 0.8))  # L0 and µM, shape (fibres,)
        >>> states = batch.step(states, np.array([0.001, 0.0]), np.full(2, 0.8), 1e-3)
        >>> batch.outputs(states)["force_f0"].shape
        (2,)
    """

    def __init__(self, fibres: Sequence[Fibre]) -> None:
        """Compile the model and line the parameters up.

        Raises:
            UserError: no fibres, or fibres of different models, methods or grids.
        """
        if not fibres:
            raise UserError("a batch needs at least one fibre; give some")
        self.muscles = tuple(Muscle(fibre) for fibre in fibres)
        first = self.muscles[0]
        for muscle in self.muscles[1:]:
            if muscle.code is not first.code or muscle.parameters.size != first.parameters.size:
                raise UserError(
                    f"fibres {first.fibre.name} ({first.fibre.model}, {first.fibre.method}) and {muscle.fibre.name} "
                    f"({muscle.fibre.model}, {muscle.fibre.method}) differ in model, method, smoothing or grid; "
                    "make one batch for each"
                )
        self.state_names = first.state_names
        self._code = first.code
        self._p = np.stack([muscle.parameters for muscle in self.muscles])
        self._p.setflags(write=False)
        for muscle, row in zip(self.muscles, self._p, strict=True):
            # One copy of a grid's tables is enough.
            muscle.parameters = row
        self._names = tuple(muscle.fibre.name for muscle in self.muscles)
        size = (len(self.muscles), len(self.state_names))
        self._work = np.zeros((numba.config.NUMBA_NUM_THREADS, SCRATCH_ROWS, size[1]))
        self._report = np.zeros((size[0], 3))

    def __len__(self) -> int:
        """Number of fibres."""
        return len(self.muscles)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickled and copied by its fibres; the copy has scratch of its own, compiled code is found anew."""
        return type(self), ([muscle.fibre for muscle in self.muscles],)

    def warm(self) -> None:
        """Take a step of 1 µs from rest, so that the first real one finds everything compiled (seconds once)."""
        states = np.stack([muscle.rest() for muscle in self.muscles])
        length, calcium = np.zeros(len(self)), np.full(len(self), 0.1)
        self.step_into(states, length, calcium, 1e-6, np.empty_like(states), self.output_table(states))

    def replaced(self, index: int, fibre: Fibre) -> MuscleBatch:
        """A batch with another fibre, of the same model, method and grid size, in one place; scratch is shared.

        Raises:
            UserError: see `MuscleBatch`.
        """
        muscle = Muscle(fibre)
        if muscle.code is not self._code or muscle.parameters.size != self._p.shape[1]:
            MuscleBatch([self.muscles[0].fibre, fibre])
        other = copy.copy(self)
        other._p = self._p.copy()
        other._p[index] = muscle.parameters
        other._p.setflags(write=False)
        muscle.parameters = other._p[index]
        other._names = (*self._names[:index], fibre.name, *self._names[index + 1 :])
        other.muscles = (*self.muscles[:index], muscle, *self.muscles[index + 1 :])
        return other

    def settle(self, length_change_l0: Array, calcium_um: Array) -> Array:
        """States after isometric activation from rest, shape (fibres, n).

        Args:
            length_change_l0: shape (fibres,), L0.
            calcium_um: shape (fibres,), µM.

        Raises:
            UserError, StateViolation: see `Muscle.settle`.
        """
        pairs = zip(self.muscles, length_change_l0, calcium_um, strict=True)
        return np.stack([muscle.settle(float(length), float(calcium)) for muscle, length, calcium in pairs])

    def step(self, states: Array, length_change_l0: Array, calcium_um: Array, dt_s: float) -> Array:
        """States `dt_s` seconds later, shape (fibres, n); see `Muscle.step`.

        Args:
            states: shape (fibres, n).
            length_change_l0: lengths at the end, shape (fibres,), L0; each moves linearly from its state's own.
            calcium_um: shape (fibres,), µM, held.
            dt_s: duration, s.

        Raises:
            UserError: of the first fibre whose length or calcium is out of range, or the duration is.
            StateViolation: of the first fibre that has one; no other fibre's state is lost, since none was changed.
        """
        out = np.empty_like(states)
        self.step_into(states, length_change_l0, calcium_um, dt_s, out)
        return out

    def step_into(
        self,
        states: Array,
        length_change_l0: Array,
        calcium_um: Array,
        dt_s: float,
        out: Array,
        table: Array = _NO_TABLE,
    ) -> None:
        """The same as `step` and `output_table` in one pass, into arrays that are there already.

        Args:
            states: see `step`.
            length_change_l0: see `step`.
            calcium_um: see `step`.
            dt_s: see `step`.
            out: receives the states; another array than `states`.
            table: receives the outputs, shape (fibres, 11); without rows: none.

        Raises:
            UserError, StateViolation: see `step`; `out` and `table` then hold nothing of use.
        """
        length = np.ascontiguousarray(length_change_l0, dtype=np.float64)
        calcium = np.ascontiguousarray(calcium_um, dtype=np.float64)
        check_many(self._names, states, self._work.shape[2], length, calcium, dt_s)
        if self._code.advance_many(states, length, calcium, dt_s, self._p, GUARD, out, self._work, self._report, table):
            k = int(np.flatnonzero(self._report[:, 0])[0])
            code, fault, time_s = self._report[k]
            self.muscles[k].complain(int(code), int(fault), float(time_s), out[k])

    def outputs(self, states: Array) -> dict[str, Array]:
        """Outputs by name of `Outputs`, each of shape (fibres,)."""
        table = self.output_table(states)
        return {name: table[:, i].copy() for i, name in enumerate(Outputs._fields)}

    def output_table(self, states: Array) -> Array:
        """Outputs, shape (fibres, 11), a column for each name of `Outputs`.

        Raises:
            UserError: no states of these fibres.
        """
        check_states(states, len(self), self._work.shape[2])
        table = np.empty((len(self.muscles), len(Outputs._fields)))
        self._code.outputs_many(states, self._p, table)
        return table
