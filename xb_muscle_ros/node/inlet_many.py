"""The callbacks of a node of many fibres: arrays by name are read, refused or handed to the stepping, and counted."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from xb_muscle_ros.node.inputs import CALCIUM_UM, Counts, Refusal, checked, stamp_ns
from xb_muscle_ros.node.several import Floats, Indices, NamesOfMany, Places, Trouble, enumerated

_WARN_EVERY_S = 5.0


class TakerOfMany(Protocol):
    """What both modes take."""

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Stamp in ns, which fibres, their free calcium in µM."""

    def take_length(
        self, stamp: int, fibres: Indices, position_m: Floats, velocity_m_per_s: Floats | None
    ) -> list[Trouble]:
        """Stamp in ns, which fibres, their lengths in m and velocities in m/s or None."""


class InletOfMany:
    """Takes ``muscle/length`` and ``muscle/calcium`` for many fibres; a message may name some of them.

    What is wrong with the message refuses it whole, what is wrong with one fibre's value refuses that. Attributes as
    of `Inlet`; `refused` counts each fibre's value.
    """

    def __init__(self, fibres: Sequence[str], taker: TakerOfMany, logger: Any) -> None:
        self.open = False
        self.refused = Counts()
        self.ignored_names = 0
        self.last_length_s: float | None = None
        self._names = NamesOfMany(fibres)
        self._fibres = list(fibres)
        self._taker = taker
        self._logger = logger
        self._warned: dict[str, float] = {}

    def take_length(self, message: Any) -> None:
        """Callback of ``muscle/length``: position m, velocity m/s or none."""
        if not self.open:
            return
        try:
            places = self._places(message)
            velocities = None
            if message.velocity:
                if len(message.velocity) != len(message.position):
                    raise Refusal(
                        "wrong array size", f"{len(message.velocity)} velocities for {len(message.position)} positions"
                    )
                velocities = _chosen(message.velocity, places)
        except Refusal as refusal:
            self._refuse("length", [Trouble(-1, refusal)])
            return
        if not places.fibres.size:
            return
        fibres, positions, troubles = places.fibres, _chosen(message.position, places), []
        if velocities is not None and not np.isfinite(velocities).all():
            bad = ~np.isfinite(velocities)
            troubles = [
                Trouble(int(fibres[k]), Refusal("not finite", f"velocity is {velocities[k]}"))
                for k in np.flatnonzero(bad).tolist()
            ]
            fibres, positions, velocities = fibres[~bad], positions[~bad], velocities[~bad]
        troubles += self._taker.take_length(stamp_ns(message.header.stamp), fibres, positions, velocities)
        if len(troubles) < places.fibres.size:
            self.last_length_s = time.monotonic()
        if troubles:
            self._refuse("length", troubles)

    def take_calcium(self, message: Any) -> None:
        """Callback of ``muscle/calcium``: position µM."""
        if not self.open:
            return
        try:
            places = self._places(message)
        except Refusal as refusal:
            self._refuse("calcium", [Trouble(-1, refusal)])
            return
        if not places.fibres.size:
            return
        fibres, values, troubles = places.fibres, _chosen(message.position, places), []
        good = (values >= CALCIUM_UM[0]) & (values <= CALCIUM_UM[1])
        if not good.all():
            for k in np.flatnonzero(~good).tolist():
                try:
                    checked(float(values[k]), CALCIUM_UM, "calcium", "µM")
                except Refusal as refusal:
                    troubles.append(Trouble(int(fibres[k]), refusal))
            fibres, values = fibres[good], values[good]
        troubles += self._taker.take_calcium(stamp_ns(message.header.stamp), fibres, values)
        if troubles:
            self._refuse("calcium", troubles)

    def _places(self, message: Any) -> Places:
        places = self._names.places(message.name, len(message.position), "position")
        if places.new:
            self.ignored_names += len(places.new)
            self._logger.warning(
                f"names ignored: {enumerated(places.new)}; this node has fibres {enumerated(self._fibres)}"
            )
        return places

    def _refuse(self, topic: str, troubles: Sequence[Trouble]) -> None:
        """Count and say what is wrong, each reason once for all fibres that have it."""
        by_reason: dict[str, list[Trouble]] = {}
        for trouble in troubles:
            error = trouble.error
            if isinstance(error, Refusal):
                by_reason.setdefault(error.reason, []).append(trouble)
            else:
                self._logger.error(f"{self._fibres[trouble.fibre]} stopped: {error}; call ~/reset to start again")
        now = time.monotonic()
        for reason, alike in by_reason.items():
            self.refused[reason] += len(alike)
            if now - self._warned.get(reason, -math.inf) < _WARN_EVERY_S:
                continue
            self._warned[reason] = now
            whose = enumerated([self._fibres[t.fibre] for t in alike if t.fibre >= 0])
            of = f" of {whose}" if whose else ""
            count = self.refused[reason]
            self._logger.warning(f"{topic}{of} refused ({reason}, {count} so far): {alike[0].error}")


def _chosen(values: Any, places: Places) -> Floats:
    """Values of a message in the order of the fibres found."""
    array = np.array(values, dtype=np.float64)
    return array if places.values is None else array[places.values]
