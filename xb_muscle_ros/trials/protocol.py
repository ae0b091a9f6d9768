"""The stretch-shorten-stretch protocol of van der Zee et al. 2026 (data of Horslen et al. 2023)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

SPEED_L0_PER_S = 0.4545
TEST_STRETCH_L0 = 0.0383
TEST_DURATION_S = TEST_STRETCH_L0 / SPEED_L0_PER_S


class Allowed(NamedTuple):
    """What a number of a protocol may be.

    Attributes:
        lower, upper: bounds.
        unit: of the number.
        positive: the lower bound itself is not allowed.
        hint: what is likely meant by a number above.
    """

    lower: float
    upper: float
    unit: str
    positive: bool = False
    hint: str = ""

    def check(self, what: str, value: float) -> None:
        """Check a number.

        Args:
            what: begins the message: the option or field.

        Raises:
            UserError: out of range or not a number.
        """
        # Written so that a NaN fails the comparison.
        if self.lower <= value <= self.upper and not (self.positive and value == self.lower):
            return
        unit = f" {self.unit}" if self.unit else ""
        least = f"above {self.lower:g}" if self.positive else f"{self.lower:g}"
        hint = self.hint.format(percent=f"{value / 100:g} is {value:g} %") if value > self.upper else ""
        raise UserError(f"{what} is {value:g}{unit}; allowed is {least} to {self.upper:g}{unit}{hint}")


_IN_L0 = ": amplitudes are in L0, {percent}"
_IN_S = ": times are in s"
ALLOWED: Mapping[str, Allowed] = MappingProxyType(
    {
        "amplitude_l0": Allowed(0.0, 0.5, "L0", hint=_IN_L0),
        "test_stretch_l0": Allowed(0.0, 0.5, "L0", hint=_IN_L0),
        "recovery_s": Allowed(0.0, 3600.0, "s", hint=_IN_S),
        "lead_s": Allowed(0.0, 3600.0, "s", hint=_IN_S),
        "hold_s": Allowed(0.0, 3600.0, "s", hint=_IN_S),
        "speed_l0_per_s": Allowed(0.0, 1000.0, "L0/s", positive=True),
        "settle_s": Allowed(0.0, 1e6, "s", positive=True, hint=_IN_S),
        "pca": Allowed(3.0, 12.0, "", hint=": pCa is -log10 of free calcium in M"),
        "rate_hz": Allowed(1.0, 1e6, "1/s"),
    }
)
"""What the numbers of a protocol may be, by name."""
_MOST_SAMPLES = 20_000_000


@dataclass(frozen=True)
class StretchShortenStretch:
    """Isometric, conditioning stretch, shortening back, recovery, test stretch, hold.

    Attributes:
        amplitude_l0: of the conditioning stretch, L0; 0 leaves stretch and shortening out (the reference trial).
        recovery_s: isometric time before the test stretch, s.
        lead_s: isometric time before the conditioning stretch, s.
        hold_s: isometric time after the test stretch, s.
        speed_l0_per_s: of all length changes.
        test_stretch_l0: amplitude of the test stretch, L0.

    Raises:
        UserError: a number is out of range; see `ALLOWED`.
    """

    amplitude_l0: float
    recovery_s: float
    lead_s: float = 0.1
    hold_s: float = 0.1
    speed_l0_per_s: float = SPEED_L0_PER_S
    test_stretch_l0: float = TEST_STRETCH_L0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            ALLOWED[name].check(f"protocol: {name}", value)

    def _stretches(self) -> list[tuple[str, float, float]]:
        """Name, duration (s) and rise (L0) of each phase of non-zero duration, in order of time."""
        ramp_s, test_s = (rise / self.speed_l0_per_s for rise in (self.amplitude_l0, self.test_stretch_l0))
        all_of_them = (
            ("isometric", self.lead_s, 0.0),
            ("conditioning_stretch", ramp_s, self.amplitude_l0),
            ("shortening", ramp_s, -self.amplitude_l0),
            ("recovery", self.recovery_s, 0.0),
            ("test_stretch", test_s, self.test_stretch_l0),
            ("hold", self.hold_s, 0.0),
        )
        return [each for each in all_of_them if each[1] > 0.0]

    @property
    def phases(self) -> tuple[Phase, ...]:
        """All phases of non-zero duration, in order of time."""
        times = self.corners()[0].tolist()
        return tuple(Phase(name, *times[i : i + 2]) for i, (name, _, _) in enumerate(self._stretches()))

    def corners(self) -> tuple[Array, Array]:
        """Times (s) and length changes (L0) of the corners; length is linear between them."""
        stretches = self._stretches()
        durations, rises = ([each[i] for each in stretches] for i in (1, 2))
        return np.cumsum([0.0, *durations]), np.cumsum([0.0, *rises])

    def trial(self, fibre: str, pca: float, rate_hz: float = 1000.0, name: str = "") -> Trial:
        """The protocol as a trial without measured force, in normalised units (1 m is one L0).

        Raises:
            UserError: pCa or rate is out of range, or there would be too many samples.
        """
        ALLOWED["pca"].check("protocol: pca", pca)
        ALLOWED["rate_hz"].check("protocol: rate_hz", rate_hz)
        corner_s, corner_l0 = self.corners()
        count = int(np.floor(corner_s[-1] * rate_hz * (1.0 + 1e-12))) + 1
        if count > _MOST_SAMPLES:
            raise UserError(
                f"protocol: {corner_s[-1]:g} s at {rate_hz:g} samples per second are {count} samples; allowed are "
                f"{_MOST_SAMPLES}: take a lower rate"
            )
        # On whole nanoseconds, as a bag will hold them: a trial and its bag give the same simulation.
        time_s = np.round(np.arange(count) / rate_hz * 1e9) / 1e9
        facts = TrialFacts(
            fibre=fibre,
            trial=name or f"amp{self.amplitude_l0 * 1e4:g}_rt{self.recovery_s * 1e3:g}ms_pca{pca * 10:g}",
            pca=pca,
            amplitude_l0=self.amplitude_l0,
            recovery_s=self.recovery_s,
            phases=self.phases,
        )
        return Trial(
            facts=facts,
            time_s=time_s,
            length_m=1.0 + np.interp(time_s, corner_s, corner_l0),
            calcium_time_s=np.zeros(1),
            calcium_um=np.array([10.0 ** (6.0 - pca)]),
        )
