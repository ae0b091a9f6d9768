"""What becomes of the fibre when length stays away."""

from __future__ import annotations

import math

from xb_muscle_ros.node.status import Log

HOLD, ISOMETRIC, DECAY = "hold", "isometric", "decay"


class Watchdog:
    """Tells how long the newest length sample is overdue, and logs when that begins and ends.

    Attributes:
        barking: whether the sample was overdue at the last look.
        timeouts: how often it became overdue.
    """

    def __init__(self, log: Log) -> None:
        self.barking = False
        self.timeouts = 0
        self._log = log
        self._overdue_arrival_ns = 0

    def overdue_s(self, arrival_ns: int, now_ns: int, timeout_s: float, on_timeout: str) -> float:
        """How much older than `timeout_s` a sample is; not positive where it is in time, or where `timeout_s` is 0.

        Args:
            arrival_ns, now_ns: steady time of the sample's arrival and of this look, ns.
            timeout_s: allowed age, s; 0 for any.
            on_timeout: what is done about it, for the log.
        """
        age_s = (now_ns - arrival_ns) * 1e-9
        overdue_s = age_s - timeout_s if timeout_s > 0.0 else -math.inf
        if overdue_s > 0.0:
            self._overdue_arrival_ns = arrival_ns
            if not self.barking:
                self.barking = True
                self.timeouts += 1
                self._log.error(f"no length for {age_s:.3f} s, timeout_s is {timeout_s:g} s: {on_timeout}")
        elif self.barking:
            self.barking = False
            away_s = (arrival_ns - self._overdue_arrival_ns) * 1e-9
            # With the old sample still in place it is the parameter that has changed.
            end = f"length is back after {away_s:.3f} s" if away_s else f"timeout_s is {timeout_s:g} s now"
            self._log.info(f"{end}: {on_timeout} ends")
        return overdue_s


def unfed(
    on_timeout: str, overdue_s: float, decay_s: float, sample_l0: float, model_l0: float, calcium_um: float
) -> tuple[float, float]:
    """Length change (L0) and calcium (µM) to step with while length is overdue.

    ``hold``: length of the last sample. ``isometric``: the length that the fibre has, so that velocity is zero from the
    first step on. ``decay``: as isometric, with calcium falling as exp(-overdue_s / decay_s).

    Args:
        on_timeout: one of the three.
        overdue_s: for how long, s.
        decay_s: time constant of calcium, s.
        sample_l0: length change of the last sample, L0.
        model_l0: length change that the fibre has, L0.
        calcium_um: newest calcium, µM.
    """
    if on_timeout == HOLD:
        return sample_l0, calcium_um
    if on_timeout == DECAY:
        calcium_um *= math.exp(-overdue_s / decay_s)
    return model_l0, calcium_um
