"""How far long work has come: on a terminal a bar, elsewhere nothing."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager
from typing import TextIO

from tqdm import tqdm


class _Bar(tqdm):  # type: ignore[misc]  # tqdm has no types
    # No thread that looks after bars: this one looks at the clock with every update.
    monitor_interval = 0


class Progress(AbstractContextManager["Progress"]):
    """A bar on stderr with count, share and time left, as long as stderr is a terminal.

    Closes with its ``with`` block, and leaves the last state of the bar on the terminal.

    Attributes:
        shown: whether there is a bar.
    """

    def __init__(self, total: int | None, label: str = "", quiet: bool = False) -> None:
        """Show the bar, empty.

        Args:
            total: how much there is to do; None where nobody knows: then count and speed are shown.
            label: shown before the bar.
            quiet: no bar on a terminal either.
        """
        self.shown = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._bar = _Bar(
            total=total,
            desc=label or None,
            file=sys.stderr,
            disable=not self.shown,
            dynamic_ncols=True,
            unit="",
            # The mean over all that was done: tasks that end side by side come in bursts.
            smoothing=0.0,
            miniters=1,
        )

    def update(self, done: int = 1) -> None:
        """So much more is done."""
        self._bar.update(done)

    def skip(self, done: int = 1) -> None:
        """So much more is done that took no time (it was kept from before), and tells nothing on the time left."""
        if self.shown:
            self._bar.initial += done
        self._bar.update(done)

    @staticmethod
    def write(line: str, file: TextIO | None = None) -> None:
        """Print a line (to stdout, or to `file`) and keep whatever bar there is whole below it."""
        tqdm.write(line, file=sys.stdout if file is None else file)

    def close(self) -> None:
        """Leave the bar as it is."""
        self._bar.close()

    def __exit__(self, *_: object) -> None:
        self.close()
