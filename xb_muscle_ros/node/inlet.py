"""The callbacks: messages are read, refused or handed to the stepping, and counted."""

from __future__ import annotations

import math
import time
from typing import Any, Protocol

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.inputs import CALCIUM_UM, Counts, Names, Refusal, checked, stamp_ns

_WARN_EVERY_S = 5.0


class Taker(Protocol):
    """What both modes take."""

    def take_calcium(self, stamp: int, calcium_um: float) -> None:
        """Stamp in ns, free calcium in µM."""

    def take_length(self, stamp: int, position_m: float, velocity_m_per_s: float | None) -> None:
        """Stamp in ns, fibre length in m and its velocity in m/s or None."""


class Inlet:
    """Takes ``muscle/length`` and ``muscle/calcium`` for one fibre.

    Attributes:
        open: whether messages are taken; while closed they are dropped.
        refused: how often input was refused, by reason.
        ignored_names: names that belong to no fibre here.
        last_length_s: steady time of the last length sample that was taken, s.
    """

    def __init__(self, fibre: str, taker: Taker, logger: Any) -> None:
        self.open = False
        self.refused = Counts()
        self.ignored_names = 0
        self.last_length_s: float | None = None
        self._names = Names(fibre)
        self._alone = [fibre]
        self._fibre = fibre
        self._taker = taker
        self._logger = logger
        self._warned: dict[str, float] = {}

    def take_length(self, message: Any) -> None:
        """Callback of ``muscle/length``: position m, velocity m/s or none."""
        if not self.open:
            return
        try:
            index = self._index(message)
            if index is None:
                return
            velocity = None
            if message.velocity:
                if len(message.velocity) != len(message.position):
                    raise Refusal(
                        "wrong array size", f"{len(message.velocity)} velocities for {len(message.position)} positions"
                    )
                velocity = message.velocity[index]
                if not math.isfinite(velocity):
                    raise Refusal("not finite", f"velocity is {velocity}")
            self._taker.take_length(stamp_ns(message.header.stamp), message.position[index], velocity)
            self.last_length_s = time.monotonic()
        except Refusal as refusal:
            self._refuse("length", refusal)
        except UserError as error:
            self._logger.error(f"stopped: {error}; call ~/reset to start again")

    def take_calcium(self, message: Any) -> None:
        """Callback of ``muscle/calcium``: position µM."""
        if not self.open:
            return
        try:
            index = self._index(message)
            if index is not None:
                calcium = checked(message.position[index], CALCIUM_UM, "calcium", "µM")
                self._taker.take_calcium(stamp_ns(message.header.stamp), calcium)
        except Refusal as refusal:
            self._refuse("calcium", refusal)

    def _index(self, message: Any) -> int | None:
        names = message.name
        index = self._names.index(names, len(message.position), "position")
        if names != self._alone:
            new = self._names.news(names)
            if new:
                self.ignored_names += len(new)
                self._logger.warning(f"names ignored: {', '.join(new)}; this node has fibre {self._fibre}")
        return index

    def _refuse(self, topic: str, refusal: Refusal) -> None:
        self.refused[refusal.reason] += 1
        now = time.monotonic()
        if now - self._warned.get(refusal.reason, -math.inf) >= _WARN_EVERY_S:
            self._warned[refusal.reason] = now
            count = self.refused[refusal.reason]
            self._logger.warning(f"{topic} refused ({refusal.reason}, {count} so far): {refusal}")
