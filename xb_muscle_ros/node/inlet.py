"""The callbacks: messages are read, refused or handed to the stepping, and counted."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.inputs import CALCIUM_UM, Counts, Names, Refusal, checked, stamp_ns
from xb_muscle_ros.node.several import enumerated

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


class Door:
    """What inlets for one fibre and for many share: whether they are open, and what they refused.

    Attributes:
        open: whether messages are taken; while closed they are dropped.
        refused: how often input was refused, by reason.
        ignored_names: names that belong to no fibre here.
        last_length_s: steady time of the last length sample that was taken, s.
        refusing: where nothing is taken any more: by topic, and name of the fibre or nothing for the whole message.
    """

    def __init__(self, logger: Any) -> None:
        self.open = False
        self.refused = Counts()
        self.ignored_names = 0
        self.last_length_s: float | None = None
        self.refusing: dict[tuple[str, str], Refused] = {}
        self._latched: set[int] = set()
        self._logger = logger
        self._warned: dict[str, float] = {}

    def forget(self) -> None:
        """Begin anew: nothing is refused for good yet, and no calcium is known from before the node listened."""
        self.refusing.clear()
        self._latched.clear()

    def _is_repeated(self, stamp: int, refusal: Exception, latched: bool) -> bool:
        """Whether calcium is refused for a stamp that is known only because two subscriptions bring the same."""
        known = latched or stamp in self._latched
        return known and isinstance(refusal, Refusal) and refusal.reason == _NOT_AFTER

    def _remember(self, stamp: int) -> None:
        if len(self._latched) < _LATCHED_KEPT:
            self._latched.add(stamp)

    def _taken(self, topic: str, whose: Iterable[str]) -> None:
        """Something of these fibres is taken again."""
        for name in ("", *whose):
            self.refusing.pop((topic, name), None)

    def _ignore(self, names: Sequence[str], here: str) -> None:
        """Count names that are new, and say which fibres are here."""
        self.ignored_names += len(names)
        self._logger.warning(f"names ignored: {enumerated(names)}; this node has {here}")

    def _refuse(self, topic: str, refusal: Refusal, times: int = 1, whose: Sequence[str] = ()) -> None:
        """Count a refusal, and warn of its reason every few seconds.

        Args:
            topic: what the message was of.
            refusal: the first of its kind.
            times: how many there are.
            whose: names of fibres, where there are several.
        """
        reason = refusal.reason
        self.refused[reason] += times
        now = time.monotonic()
        for name in whose or ("",):
            before = self.refusing.get((topic, name))
            since_s, count = (now, 0) if before is None else before[:2]
            self.refusing[topic, name] = Refused(since_s, count + 1, str(refusal))
        if now - self._warned.get(reason, -math.inf) >= _WARN_EVERY_S:
            self._warned[reason] = now
            of = f" of {enumerated(whose)}" if whose else ""
            self._logger.warning(f"{topic}{of} refused ({reason}, {self.refused[reason]} so far): {refusal}")


def check_velocities(message: Any) -> None:
    """Check that a message has a velocity for each position, or none.

    Raises:
        Refusal: it has not.
    """
    if message.velocity and len(message.velocity) != len(message.position):
        raise Refusal("wrong array size", f"{len(message.velocity)} velocities for {len(message.position)} positions")


class Taker(Protocol):
    """What both modes take."""

    def take_calcium(self, stamp: int, calcium_um: float) -> None:
        """Stamp in ns, free calcium in µM."""

    def take_length(self, stamp: int, position_m: float, velocity_m_per_s: float | None) -> None:
        """Stamp in ns, fibre length in m and its velocity in m/s or None."""


class Inlet(Door):
    """Takes ``muscle/length`` and ``muscle/calcium`` for one fibre."""

    def __init__(self, fibre: str, taker: Taker, logger: Any) -> None:
        super().__init__(logger)
        self._names = Names(fibre)
        self._alone = [fibre]
        self._fibre = fibre
        self._taker = taker

    def take_length(self, message: Any) -> None:
        """Callback of ``muscle/length``: position m, velocity m/s or none."""
        if not self.open:
            return
        try:
            index = self._index(message)
            if index is None:
                return
            check_velocities(message)
            velocity = None
            if message.velocity:
                velocity = message.velocity[index]
                if not math.isfinite(velocity):
                    raise Refusal("not finite", f"velocity is {velocity}")
            self._taker.take_length(stamp_ns(message.header.stamp), message.position[index], velocity)
            self.last_length_s = time.monotonic()
            if self.refusing:
                self._taken("length", ())
        except Refusal as refusal:
            self._refuse("length", refusal)
        except UserError as error:
            self._logger.error(f"stopped: {error}; call ~/reset to start again")

    def take_calcium(self, message: Any, latched: bool = False) -> None:
        """Callback of ``muscle/calcium``: position µM; `latched` where a publisher kept it for who listens late."""
        if not self.open:
            return
        try:
            index = self._index(message)
            if index is not None:
                calcium = checked(message.position[index], CALCIUM_UM, "calcium", "µM")
                self._taker.take_calcium(stamp_ns(message.header.stamp), calcium)
                if latched:
                    self._remember(stamp_ns(message.header.stamp))
                if self.refusing:
                    self._taken("calcium", ())
        except Refusal as refusal:
            if not self._is_repeated(stamp_ns(message.header.stamp), refusal, latched):
                self._refuse("calcium", refusal)

    def _index(self, message: Any) -> int | None:
        names = message.name
        index = self._names.index(names, len(message.position), "position")
        if names != self._alone:
            new = self._names.news(names)
            if new:
                self._ignore(new, f"fibre {self._fibre}")
        return index
