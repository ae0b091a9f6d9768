"""Counts messages that were sent and did not come: each carries its publisher's number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import Any

_NUMBER = "publication_sequence_number"


class Arrivals:
    """A subscription's callback that hands messages on and looks at their numbers.

    Numbers tell of losses where there is one publisher: rclpy does not say whose number it is.

    Attributes:
        lost: messages that did not come since the last reset, while it was counting.
        counting: whether losses matter now.
        publishers: matched at the moment.
        numbered: whether the middleware gives numbers.
    """

    # rclpy reads from it whether information about a message is wanted beside the message.
    __signature__ = Signature([Parameter(name, Parameter.POSITIONAL_ONLY) for name in ("message", "information")])

    def __init__(self, take: Callable[[Any], None], on_matched: Callable[[], None] = lambda: None) -> None:
        """Hand messages on to `take`; `on_matched` is called where publishers come or go."""
        self.lost = 0
        self.counting = False
        self.publishers = 0
        self.numbered = True
        self._take = take
        self._on_matched = on_matched
        self._last: int | None = None

    def __call__(self, message: Any, information: Mapping[str, Any] | None = None) -> None:
        """Take a message."""
        if information is None:
            # The executor driven by events hands both over as one.
            message, information = message
        number, last = information.get(_NUMBER), self._last
        self._last = number
        if number is None:
            self.numbered = False
        elif last is not None and number - last > 1 and self.counting and self.publishers < 2:
            self.lost += number - last - 1
        self._take(message)

    def matched(self, event: Any) -> None:
        """Publishers have come or gone; a new one counts from anywhere."""
        self.publishers = event.current_count
        self._last = None
        self._on_matched()

    def told(self) -> str:
        """How many were lost, in words."""
        if not self.numbered:
            return "not known with this middleware"
        return str(self.lost) if self.publishers < 2 else f"{self.lost}, not counted while {self.publishers} publish"
