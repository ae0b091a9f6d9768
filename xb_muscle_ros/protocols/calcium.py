"""Free calcium of an intact fibre that is stimulated: a transient for each pulse, for protocols that stimulate.

The calcium that one pulse adds rises and decays by two exponentials,

    Ca(t) - rest = (peak - rest) (exp(-t/decay) - exp(-t/rise)) / m,

m being the largest value of the bracket, so that the transient of a rested fibre has its peak where it is told. Pulses
sum, but each releases less the more of the earlier ones is still there: of what a rested fibre releases it adds the
share that is left below a ceiling, which free calcium can therefore not pass in any train (binding sites and stores are
limited; one number stands for both). The default is a slow-twitch fibre of the mouse: in response to one action
potential at 16 °C free calcium rises by 9.4 µM, for 7.7 ms at half of it (Baylor & Hollingworth 2003, J Physiol 551:
125-138); the rise of 1.5 ms is set and the decay of 5.7 ms follows from it. Force does not act back on calcium. What
`trials.activation` makes of recorded stimulation is a tetanus whose pulses are not resolved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import Option, Settings
from xb_muscle_ros.protocols.inputs import calcium_um
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed
from xb_muscle_ros.trials.trial import Array

_TIME_CONSTANT_S = Allowed(1e-5, 10.0, "s", hint=": times are in s")
# Time constants that are nearer than this are one, and the bracket vanishes.
_NEAREST = 1e-3


@dataclass(frozen=True)
class PulseTransient:
    """What one pulse adds to free calcium, and how pulses add up.

    Attributes:
        rest_um, peak_um: free calcium before the first pulse and at the peak that it makes, µM.
        rise_s, decay_s: time constants, s.
        ceiling_um: free calcium that no train of pulses passes, µM.

    Raises:
        UserError: rest, peak and ceiling are not in this order and far enough from each other, or rise is not below
            decay.
    """

    rest_um: float
    peak_um: float
    rise_s: float
    decay_s: float
    ceiling_um: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value > 0.0):
                raise UserError(f"calcium: {field.name} is {value:g}; allowed are numbers above 0")
        if self.rise_s > (1.0 - _NEAREST) * self.decay_s:
            raise UserError(
                f"calcium: the time constant of the rise is {self.rise_s:g} s; it has to be below that of the decay, "
                f"{self.decay_s:g} s"
            )
        if self.peak_um <= self.rest_um:
            raise UserError(
                f"calcium: the peak is {self.peak_um:g} µM; it has to be above rest, {self.rest_um:g} µM (the peak's "
                "pCa below that of rest)"
            )
        least = self.rest_um + (self.peak_um - self.rest_um) / self._largest
        if self.ceiling_um < least:
            raise UserError(
                f"calcium: the ceiling is {self.ceiling_um:.4g} µM; with this peak and these time constants it has to "
                f"be {least:.4g} µM or more (pCa {6.0 - np.log10(least):.3f} or less)"
            )

    @property
    def _largest(self) -> float:
        """Largest value of exp(-t/decay) - exp(-t/rise)."""
        at_s = np.log(self.decay_s / self.rise_s) * self.rise_s * self.decay_s / (self.decay_s - self.rise_s)
        return float(np.exp(-at_s / self.decay_s) - np.exp(-at_s / self.rise_s))

    def at(self, time_s: Array, pulses_s: Sequence[float]) -> Array:
        """Free calcium, µM, shape (n,).

        Args:
            time_s: shape (n,), increasing, s.
            pulses_s: times of the pulses, in order, s; before the first the fibre is at rest.
        """
        pulses = np.asarray(pulses_s, dtype=float)
        full = self.peak_um - self.rest_um
        limit = self._largest * (self.ceiling_um - self.rest_um)
        # Behind each pulse: what decays slowly, and what has still to rise.
        slow, fast = np.zeros(pulses.size), np.zeros(pulses.size)
        here, still, before_s = 0.0, 0.0, pulses[0] if pulses.size else 0.0
        for k, pulse_s in enumerate(pulses.tolist()):
            here *= float(np.exp((before_s - pulse_s) / self.decay_s))
            still *= float(np.exp((before_s - pulse_s) / self.rise_s))
            added = full * (1.0 - here / limit)
            here, still, before_s = here + added, still + added, pulse_s
            slow[k], fast[k] = here, still
        last = np.searchsorted(pulses, time_s, side="right") - 1
        calcium = np.full(np.shape(time_s), self.rest_um)
        after = last >= 0
        which, since_s = last[after], time_s[after] - pulses[last[after]]
        excess = slow[which] * np.exp(-since_s / self.decay_s) - fast[which] * np.exp(-since_s / self.rise_s)
        calcium[after] += excess / self._largest
        return calcium


def transient_options() -> tuple[Option, ...]:
    """Options of every protocol that stimulates."""
    pca = ALLOWED["pca"]
    return (
        Option("peak-pca", (5.02,), pca, "pCa at the peak of the calcium transient of one pulse", many=False),
        Option("rest-pca", (7.0,), pca, "pCa of the fibre before it is stimulated", many=False),
        Option("ceiling-pca", (4.5,), pca, "pCa that no train of pulses passes", many=False),
        Option("calcium-rise", (0.0015,), _TIME_CONSTANT_S, "time constant of the calcium transient's rise, s", False),
        Option("calcium-decay", (0.0057,), _TIME_CONSTANT_S, "time constant of its decay, s", many=False),
    )


def transient_of(settings: Settings) -> PulseTransient:
    """The transient that a protocol's settings name.

    Raises:
        UserError: see `PulseTransient`.
    """
    rest, peak, ceiling = (calcium_um(settings[f"{name}-pca"][0]) for name in ("rest", "peak", "ceiling"))
    return PulseTransient(rest, peak, settings["calcium-rise"][0], settings["calcium-decay"][0], ceiling)


def pulse_train(start_s: float, duration_s: float, rate_hz: float) -> list[float]:
    """Times of pulses from a start on, at least one, s; a pulse that would fall on the end is not given."""
    count = max(1, int(np.ceil(duration_s * rate_hz * (1.0 - 1e-9))))
    return [start_s + k / rate_hz for k in range(count)]
