"""The callbacks: messages are read, refused or handed to the stepping, and counted."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.names import Indices, Names, Places, enumerated, front
from xb_muscle_ros.node.rules import CALCIUM_UM, Counts, Refusal, Trouble, inside, outside
from xb_muscle_ros.node.stepping import Floats, Stepping

_WARN_EVERY_S = 5.0
_NOT_AFTER = "stamp not after the last"
# A publisher may be asked for what it kept while it sends more of the same; beyond this nobody keeps so much.
_LATCHED_KEPT = 10_000


class Refused(NamedTuple):
    """The newest input of a topic was refused, and so was all of it since.

    Attributes:
        since_s: steady time, s.
        times: how often.
        text: of the newest.
    """

    since_s: float
    times: int
    text: str


class Inlet:
    """Takes ``muscle/length`` or ``muscle/load``, and ``muscle/calcium``; a message may name some of the fibres.

    What is wrong with the message refuses it whole, what is wrong with one fibre's value refuses that.

    Attributes:
        open: whether messages are taken; while closed they are dropped.
        refused: how often input was refused, by reason; each fibre's value counts.
        ignored_names: names that belong to no fibre here.
        last_length_s: steady time of the last sample of length or load that was taken, s.
        refusing: where nothing is taken any more: by topic, and name of the fibre, or nothing for the whole message and
            in a node of one fibre.
    """

    def __init__(self, fibres: Sequence[str], taker: Stepping, logger: Any) -> None:
        """Be closed at first; `fibres` are names."""
        self.open = False
        self.refused = Counts()
        self.ignored_names = 0
        self.last_length_s: float | None = None
        self.refusing: dict[tuple[str, str], Refused] = {}
        self._fibres = list(fibres)
        self._names = Names(fibres)
        self._taker = taker
        self._latched: set[int] = set()
        self._logger = logger
        self._warned: dict[str, float] = {}

    def forget(self) -> None:
        """Begin anew: nothing is refused for good yet, and no calcium is known from before the node listened."""
        self.refusing.clear()
        self._latched.clear()

    def refuse(self, topic: str, refusal: Refusal) -> None:
        """Count a message of ``muscle/<topic>`` that could not be read, and say so."""
        if self.open:
            self._refuse(topic, refusal, [])

    def take_length(self, message: Joints) -> None:
        """Callback of ``muscle/length``: position m, velocity m/s or none."""
        places = self._places("length", message) if self.open else None
        if places is None:
            return
        fibres, troubles = places.fibres, []
        positions, velocities = _chosen(message.position, places), None
        if message.velocity.size:
            velocities = _chosen(message.velocity, places)
            finite = np.isfinite(velocities)
            if not finite.all():
                for k in np.flatnonzero(~finite).tolist():
                    troubles.append(Trouble(int(fibres[k]), Refusal("not finite", f"velocity is {velocities[k]}")))
                fibres, positions, velocities = fibres[finite], positions[finite], velocities[finite]
        if fibres.size:
            troubles += self._taker.take_length(message.stamp_ns, fibres, positions, velocities)
        if len(troubles) < places.fibres.size:
            self.last_length_s = time.monotonic()
        if troubles or self.refusing:
            self._tell("length", places.fibres, troubles, troubles)

    def take_load(self, message: Joints) -> None:
        """Callback of ``muscle/load``: effort N."""
        places = self._places("load", message, "effort") if self.open else None
        if places is None:
            return
        troubles = self._taker.take_length(message.stamp_ns, places.fibres, _chosen(message.effort, places), None)
        if len(troubles) < places.fibres.size:
            self.last_length_s = time.monotonic()
        if troubles or self.refusing:
            self._tell("load", places.fibres, troubles, troubles)

    def take_calcium(self, message: Joints, latched: bool = False) -> None:
        """Callback of ``muscle/calcium``: position µM; `latched` where a publisher kept it for who listens late."""
        places = self._places("calcium", message) if self.open else None
        if places is None:
            return
        fibres, troubles = places.fibres, []
        values = _chosen(message.position, places)
        good = inside(values, CALCIUM_UM)
        if not good.all():
            for k in np.flatnonzero(~good).tolist():
                refusal = outside(float(values[k]), CALCIUM_UM, "calcium", "µM")
                troubles.append(Trouble(int(fibres[k]), refusal))
            fibres, values = fibres[good], values[good]
        stamp = message.stamp_ns
        if fibres.size:
            troubles += self._taker.take_calcium(stamp, fibres, values)
        # A stamp that is known only because two subscriptions bring the same is nothing to speak of.
        known = latched or stamp in self._latched
        told = [t for t in troubles if not (known and isinstance(t.error, Refusal) and t.error.reason == _NOT_AFTER)]
        if latched and len(troubles) < places.fibres.size and len(self._latched) < _LATCHED_KEPT:
            self._latched.add(stamp)
        if told or self.refusing:
            self._tell("calcium", places.fibres, troubles, told)

    def _places(self, topic: str, message: Joints, field: str = "position") -> Places | None:
        """Where the fibres of a message are; None where it has nothing for any of them, or is refused."""
        try:
            places = self._names.places(message.names, getattr(message, field).size, field)
            if places.new:
                self.ignored_names += len(places.new)
                here = f"fibre{'s' if len(self._fibres) > 1 else ''} {enumerated(self._fibres)}"
                self._logger.warning(f"names ignored: {enumerated(places.new)}; this node has {here}")
            if not places.fibres.size:
                return None
            if topic == "length" and message.velocity.size not in (0, message.position.size):
                told = f"{message.velocity.size} velocities for {message.position.size} positions"
                raise Refusal("wrong array size", told)
        except Refusal as refusal:
            self._refuse(topic, refusal, [])
            return None
        return places

    def _tell(self, topic: str, fibres: Indices, troubles: Sequence[Trouble], told: Sequence[Trouble]) -> None:
        """Count and say what is wrong, each reason once for all fibres that have it; the others are well again."""
        bad = {trouble.fibre for trouble in troubles}
        well = [i for i in fibres.tolist() if i not in bad]
        if well or len(self._fibres) > 1:
            for name in ("", *(self._fibres[i] for i in well)):
                self.refusing.pop((topic, name), None)
        by_reason: dict[str, list[tuple[int, Refusal]]] = {}
        for i, error in told:
            if isinstance(error, Refusal):
                by_reason.setdefault(error.reason, []).append((i, error))
            else:
                self._logger.error(f"{front(self._fibres, [i], ' ')}stopped: {error}; call ~/reset to start again")
        for alike in by_reason.values():
            self._refuse(topic, alike[0][1], [i for i, _ in alike])

    def _refuse(self, topic: str, refusal: Refusal, whose: Sequence[int]) -> None:
        """Count a refusal, and warn of its reason every few seconds.

        Args:
            topic: what the message was of.
            refusal: the first of its kind.
            whose: fibres that have it; empty: the whole message.
        """
        reason = refusal.reason
        self.refused[reason] += len(whose) or 1
        now = time.monotonic()
        names = [self._fibres[i] for i in whose] if len(self._fibres) > 1 else []
        for name in names or [""]:
            before = self.refusing.get((topic, name))
            since_s, count = (now, 0) if before is None else before[:2]
            self.refusing[topic, name] = Refused(since_s, count + 1, str(refusal))
        if now - self._warned.get(reason, -math.inf) >= _WARN_EVERY_S:
            self._warned[reason] = now
            of = f" of {enumerated(names)}" if names else ""
            self._logger.warning(f"{topic}{of} refused ({reason}, {self.refused[reason]} so far): {refusal}")


def _chosen(values: Floats, places: Places) -> Floats:
    """Values of a message in the order of the fibres found."""
    return values if places.values is None else values[places.values]
