"""Force and moments of a muscle node's fibres as messages."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from xb_muscle_ros.models.muscle import Outputs
from xb_muscle_ros.models.registry import PUSHES_F0
from xb_muscle_ros.node.names import KINDS_KEPT, Indices
from xb_muscle_ros.node.stepping import Floats
from xb_muscle_ros.node.traffic import Outlet
from xb_muscle_ros.trials.joint_layout import FIELDS
from xb_muscle_ros.trials.simulated import MOMENTS

_FORCE, _CE_LENGTH, _CE_VELOCITY, _FIRST = (
    Outputs._fields.index(name) for name in ("force_f0", "ce_length_change_l0", "ce_velocity_l0_per_s", MOMENTS[0])
)
_MOMENTS = slice(_FIRST, _FIRST + len(MOMENTS))
assert tuple(Outputs._fields[_MOMENTS]) == MOMENTS


class OutputMessages:
    """Publishes forces (``muscle/force``) and moments (``muscle/moments``), of all fibres in one message each.

    Force: effort, N; position and velocity of the contractile element, m and m/s. Moments: dimensionless, in position.
    Under force control lengths as well (``muscle/length``): position, m.

    Attributes:
        pushed: fibre and force (F0) of the strongest push since it was last cleared; None where all pulled.
    """

    def __init__(
        self, fibres: Sequence[str], force: Any, moments: Any, bytes_: bool = False, length: Any = None
    ) -> None:
        """Fill messages of these fibres.

        Args:
            fibres: names.
            force, moments: publishers of rclpy.
            bytes_: as in `Outlet`.
            length: publisher of the lengths that bear a load; None where length is given.
        """
        self._to_length = length
        self.pushed: tuple[str, float] | None = None
        self._names = list(fibres)
        self._to_force = force
        self._to_moments = moments
        self._bytes = bytes_
        self._all = self._made(self._names)
        # Those who come in part mostly come in the same parts.
        self._part = functools.lru_cache(KINDS_KEPT)(self._made_of)
        # The first message shall not wait for a compiler.
        force, *_ = self._all
        size = len(self._names)
        _fill(np.zeros((size, len(Outputs._fields))), np.zeros((size, 2)), force.position, force.velocity, force.effort)

    def publish(
        self,
        stamp_ns: int,
        which: Indices | None,
        outputs: Floats,
        scales: Floats,
        change_l0: Floats | None = None,
    ) -> None:
        """Send the outputs of one moment.

        Args:
            stamp_ns: of the messages.
            which: fibres; None: all, in order.
            outputs: shape (fibres, 11), a column for each name of `Outputs`.
            scales: shape (fibres, 2), one L0 (m) and one F0 (N).
            change_l0: length changes that bear a load, shape (fibres,), L0; None where length is given.
        """
        force, moments, length = self._all if which is None else self._part(which.tobytes())
        if length is not None and change_l0 is not None:
            length.position[:] = scales[:, 0] * (1.0 + change_l0)
            length.publish(stamp_ns)
        weakest, least = _fill(outputs, scales, force.position, force.velocity, force.effort)
        force.publish(stamp_ns)
        if least < PUSHES_F0 and (self.pushed is None or least < self.pushed[1]):
            self.pushed = force.names[weakest], least
        # Publishing is the dearest part of a tick; nobody misses what nobody listens to.
        if self._to_moments.get_subscription_count():
            moments.position[:] = outputs[:, _MOMENTS].ravel()
            moments.publish(stamp_ns)

    def _made_of(self, which: bytes) -> tuple[Outlet, Outlet, Outlet | None]:
        return self._made([self._names[i] for i in np.frombuffer(which, dtype=np.intp).tolist()])

    def _made(self, names: Sequence[str]) -> tuple[Outlet, Outlet, Outlet | None]:
        moments = [f"{fibre}/{name}" for fibre in names for name in MOMENTS]
        length = self._to_length
        return (
            Outlet(self._to_force, names, len(names), FIELDS, self._bytes),
            Outlet(self._to_moments, moments, len(moments), FIELDS[:1], self._bytes),
            None if length is None else Outlet(length, names, len(names), FIELDS[:1], self._bytes),
        )


@njit(cache=True)
def _fill(outputs: Floats, scales: Floats, position: Floats, velocity: Floats, effort: Floats) -> tuple[int, float]:
    """Put force and contractile elements into a message; returns who pulls least, and that force in F0."""
    weakest = 0
    for k in range(outputs.shape[0]):
        reference_m, f0_n = scales[k]
        effort[k] = f0_n * outputs[k, _FORCE]
        position[k] = reference_m * (1.0 + outputs[k, _CE_LENGTH])
        velocity[k] = reference_m * outputs[k, _CE_VELOCITY]
        if outputs[k, _FORCE] < outputs[weakest, _FORCE]:
            weakest = k
    return weakest, outputs[weakest, _FORCE]
