"""What a model answered to a trial: force, contractile element and moments, sample by sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array, frozen

MOMENTS = ("q0", "q1", "q2", "n_on", "drx", "r")


@dataclass(frozen=True)
class Simulated:
    """Outputs of one simulated trial; arrays are read-only.

    Attributes:
        time_s: shape (n,), strictly increasing, s; the clock of the trial.
        force_n: shape (n,), fibre force, N.
        ce_length_m: shape (n,), length of the contractile element, m.
        ce_velocity_m_per_s: shape (n,), velocity of the contractile element, m/s; positive lengthens.
        moments: ``q0``, ``q1``, ``q2``, ``n_on``, ``drx`` and ``r``, each of shape (n,), dimensionless.

    Raises:
        UserError: a moment is missing or unknown, or shapes differ.
    """

    time_s: Array
    force_n: Array
    ce_length_m: Array
    ce_velocity_m_per_s: Array
    moments: Mapping[str, Array]

    def __post_init__(self) -> None:
        if set(self.moments) != set(MOMENTS):
            raise UserError(f"moments are {sorted(self.moments)}; needed are {', '.join(MOMENTS)}")
        for name in ("time_s", "force_n", "ce_length_m", "ce_velocity_m_per_s"):
            object.__setattr__(self, name, self._frozen(name, getattr(self, name)))
        moments = {name: self._frozen(name, self.moments[name]) for name in MOMENTS}
        object.__setattr__(self, "moments", MappingProxyType(moments))

    def _frozen(self, name: str, values: Array) -> Array:
        array = frozen(values)
        if array.shape != np.shape(self.time_s) or array.ndim != 1:
            raise UserError(f"{name} has shape {array.shape}; needed is the shape of time_s, {np.shape(self.time_s)}")
        return array
