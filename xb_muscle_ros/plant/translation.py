"""Motion of the platform a person stands on."""

from __future__ import annotations

import math
from dataclasses import dataclass

from xb_muscle_ros.errors import UserError


@dataclass(frozen=True)
class RampAndHold:
    """Constant acceleration to a speed, constant speed, constant deceleration to rest; backwards where negative.

    Attributes:
        displacement_m: in all; its sign is the direction.
        speed_m_per_s: highest, above 0.
        acceleration_m_per_s2: above 0.
        start_s: when it begins.
    """

    displacement_m: float = -0.075
    speed_m_per_s: float = 0.2
    acceleration_m_per_s2: float = 2.0
    start_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse motions that no platform makes.

        Raises:
            UserError: a number out of range.
        """
        for name, value, lower, upper in (
            ("displacement", self.displacement_m, -1.0, 1.0),
            ("speed", self.speed_m_per_s, 1e-3, 5.0),
            ("acceleration", self.acceleration_m_per_s2, 1e-2, 50.0),
        ):
            if not lower <= value <= upper:
                raise UserError(f"the platform's {name} is {value:g}; allowed is {lower:g} to {upper:g} (m and s)")

    @property
    def _times_s(self) -> tuple[float, float]:
        """Lengths of acceleration and of constant speed."""
        distance = abs(self.displacement_m)
        rise = min(self.speed_m_per_s / self.acceleration_m_per_s2, math.sqrt(distance / self.acceleration_m_per_s2))
        speed = rise * self.acceleration_m_per_s2
        return rise, (distance - rise * speed) / speed if speed > 0.0 else 0.0

    def velocity_at(self, time_s: float) -> float:
        """Velocity, m/s, forward positive."""
        rise, cruise = self._times_s
        since = time_s - self.start_s
        shape = min(since, rise, 2.0 * rise + cruise - since)
        return math.copysign(max(shape, 0.0) * self.acceleration_m_per_s2, self.displacement_m)

    def mean_acceleration(self, time_s: float, tick_s: float) -> float:
        """Mean acceleration from a time over a tick, m/s²: what a stepped plant needs to reach the velocity exactly."""
        return (self.velocity_at(time_s + tick_s) - self.velocity_at(time_s)) / tick_s
