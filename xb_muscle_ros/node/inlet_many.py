"""The callbacks of a node of many fibres: arrays by name are read, refused or handed to the stepping, and counted."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from xb_muscle_ros.node.inlet import Door, check_velocities
from xb_muscle_ros.node.inputs import CALCIUM_UM, Refusal, checked, stamp_ns
from xb_muscle_ros.node.several import Floats, Indices, NamesOfMany, Places, Trouble, enumerated


class TakerOfMany(Protocol):
    """What both modes take."""

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Stamp in ns, which fibres, their free calcium in µM."""

    def take_length(
        self, stamp: int, fibres: Indices, position_m: Floats, velocity_m_per_s: Floats | None
    ) -> list[Trouble]:
        """Stamp in ns, which fibres, their lengths in m and velocities in m/s or None."""


class InletOfMany(Door):
    """Takes ``muscle/length`` and ``muscle/calcium`` for many fibres; a message may name some of them.

    What is wrong with the message refuses it whole, what is wrong with one fibre's value refuses that;
    `refused` counts each fibre's value.
    """

    def __init__(self, fibres: Sequence[str], taker: TakerOfMany, logger: Any) -> None:
        super().__init__(logger)
        self._names = NamesOfMany(fibres)
        self._fibres = list(fibres)
        self._taker = taker

    def take_length(self, message: Any) -> None:
        """Callback of ``muscle/length``: position m, velocity m/s or none."""
        if not self.open:
            return
        try:
            places = self._places(message)
            check_velocities(message)
        except Refusal as refusal:
            self._refuse("length", refusal)
            return
        if not places.fibres.size:
            return
        fibres, positions, troubles = places.fibres, _chosen(message.position, places), []
        velocities = _chosen(message.velocity, places) if message.velocity else None
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
        if self.refusing:
            self._taken("length", self._without(places, troubles))
        if troubles:
            self._tell("length", troubles)

    def take_calcium(self, message: Any, latched: bool = False) -> None:
        """Callback of ``muscle/calcium``: position µM; `latched` as for `Inlet`."""
        if not self.open:
            return
        try:
            places = self._places(message)
        except Refusal as refusal:
            self._refuse("calcium", refusal)
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
        stamp = stamp_ns(message.header.stamp)
        refused = self._taker.take_calcium(stamp, fibres, values)
        if latched:
            self._remember(stamp)
        if self.refusing:
            self._taken("calcium", self._without(places, [*troubles, *refused]))
        troubles += [trouble for trouble in refused if not self._is_repeated(stamp, trouble.error, latched)]
        if troubles:
            self._tell("calcium", troubles)

    def _places(self, message: Any) -> Places:
        places = self._names.places(message.name, len(message.position), "position")
        if places.new:
            self._ignore(places.new, f"fibres {enumerated(self._fibres)}")
        return places

    def _without(self, places: Places, troubles: Sequence[Trouble]) -> list[str]:
        """Names of the fibres of a message that are not among the troubled."""
        bad = {trouble.fibre for trouble in troubles}
        return [self._fibres[i] for i in places.fibres.tolist() if i not in bad]

    def _tell(self, topic: str, troubles: Sequence[Trouble]) -> None:
        """Count and say what is wrong, each reason once for all fibres that have it."""
        by_reason: dict[str, list[tuple[str, Refusal]]] = {}
        for trouble in troubles:
            name, error = self._fibres[trouble.fibre], trouble.error
            if isinstance(error, Refusal):
                by_reason.setdefault(error.reason, []).append((name, error))
            else:
                self._logger.error(f"{name} stopped: {error}; call ~/reset to start again")
        for alike in by_reason.values():
            self._refuse(topic, alike[0][1], len(alike), [name for name, _ in alike])


def _chosen(values: Any, places: Places) -> Floats:
    """Values of a message in the order of the fibres found."""
    array = np.array(values, dtype=np.float64)
    return array if places.values is None else array[places.values]
