"""What becomes of fibres whose length, or load, stays away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.node.names import front
from xb_muscle_ros.node.samples import Inputs
from xb_muscle_ros.node.status import Log
from xb_muscle_ros.node.stepping import Flags, Floats

HOLD, ISOMETRIC, DECAY = "hold", "isometric", "decay"


class Watchdog:
    """Tells how long fibres' newest length samples are overdue, and logs when that begins and ends.

    Attributes:
        overdue: fibres whose sample was overdue at the last look.
        timeouts: how often one became overdue since the last `forget` of all.
    """

    def __init__(self, names: Sequence[str], log: Log, topic: str = "length") -> None:
        """Watch fibres of these names; `topic` is what they are to be sent."""
        self._topic = topic
        self._names = names
        self._log = log
        self._arrival_ns = np.zeros(len(names), dtype=np.int64)
        self.overdue: Flags = np.zeros(len(names), dtype=np.bool_)
        self.timeouts = 0
        self._any = False

    def forget(self, which: Flags) -> None:
        """These fibres begin anew."""
        self.overdue = self.overdue & ~which
        self._any = bool(self.overdue.any())
        if which.all():
            self.timeouts = 0

    def look(
        self, inputs: Inputs, since_ns: int, now_ns: int, timeout_s: float, on_timeout: str, live: Flags
    ) -> Floats | None:
        """How much older than `timeout_s` each fibre's sample is, at least 0, s; None where none is.

        Args:
            inputs: newest samples.
            since_ns, now_ns: steady time from which ages count at most, and of this look, ns.
            timeout_s: allowed age, s; 0 for any.
            on_timeout: what is done about it, for the log.
            live: fibres that are stepped.
        """
        if not self._any and (timeout_s <= 0.0 or (now_ns - max(inputs.oldest_ns, since_ns)) * 1e-9 <= timeout_s):
            return None
        arrival_ns = np.maximum(inputs.arrival_ns, since_ns)
        age_s = (now_ns - arrival_ns) * 1e-9
        overdue_s = age_s - timeout_s
        overdue = (overdue_s > 0.0) & live & (timeout_s > 0.0)
        if not np.array_equal(overdue, self.overdue):
            begun, over = overdue & ~self.overdue, self.overdue & ~overdue & live
            self.overdue, self._any = overdue, bool(overdue.any())
            self._tell(begun, over, age_s, (arrival_ns - self._arrival_ns) * 1e-9, timeout_s, on_timeout)
        self._arrival_ns = np.where(overdue, arrival_ns, self._arrival_ns)
        return np.maximum(overdue_s, 0.0) if self._any else None

    def _tell(
        self, begun: Flags, over: Flags, age_s: Floats, away_s: Floats, timeout_s: float, on_timeout: str
    ) -> None:
        if begun.any():
            which = np.flatnonzero(begun).tolist()
            self.timeouts += len(which)
            told = f"no {self._topic} for {age_s[which[0]]:.3f} s, timeout_s is {timeout_s:g} s: {on_timeout}"
            self._log.error(front(self._names, which) + told)
        if over.any():
            which = np.flatnonzero(over).tolist()
            away = away_s[which[0]]
            # With the old sample still in place it is the parameter that has changed.
            end = f"{self._topic} is back after {away:.3f} s" if away else f"timeout_s is {timeout_s:g} s now"
            self._log.info(f"{front(self._names, which)}{end}: {on_timeout} ends")


def unfed(
    on_timeout: str, overdue_s: Floats, decay_s: float, sample: Floats, still: Floats, calcium_um: Floats
) -> tuple[Floats, Floats]:
    """Goals (length change, L0, or load, F0) and calcium (µM) to step fibres with whose sample is overdue.

    ``hold``: length or load of the last sample. ``isometric``: the length that the fibre has, so that velocity is zero
    from the first step on. ``decay``: as isometric, with calcium falling as exp(-overdue_s / decay_s).

    Args:
        on_timeout: one of the three.
        overdue_s: for how long, s.
        decay_s: time constant of calcium, s.
        sample: goals of the last samples.
        still: goals at which the fibres keep their lengths.
        calcium_um: newest calcium, µM.
    """
    if on_timeout == HOLD:
        return sample, calcium_um
    if on_timeout == DECAY:
        calcium_um = calcium_um * np.exp(-overdue_s / decay_s)
    return still, calcium_um
