"""What is said while a function works: each line goes to the result, and to the caller at once."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable

from xb_muscle_ros.errors import DataWarning

Tell = Callable[[str], None]
"""Hears one line on what was guessed, left out or taken for granted."""

_PACKAGE = __name__.partition(".")[0]


class Lines(list[str]):
    """Lines that were said, in order."""

    def __init__(self, tell: Tell | None) -> None:
        """Nothing said yet.

        Args:
            tell: hears each line; None: it becomes a `DataWarning`.
        """
        super().__init__()
        self._tell = as_warning if tell is None else tell

    def say(self, *lines: str | None) -> None:
        """Keep lines and pass them on; empty ones and None are no lines."""
        for line in filter(None, lines):
            self.append(line)
            self._tell(line)


def as_warning(line: str) -> None:
    """Give a line as a `DataWarning` that points to the caller's own code."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == _PACKAGE:
        frame, level = frame.f_back, level + 1
    warnings.warn(line, DataWarning, stacklevel=level)
