"""How every program of this package ends."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

READER_LEFT = 141


def run(program: Callable[[], int | None]) -> None:
    """Run a program and exit with its code (None is 0), quietly where whoever read its output has left.

    Raises:
        SystemExit: always.
    """
    try:
        try:
            code = program()
        finally:
            # Not left to the interpreter's end, which complains by itself.
            sys.stdout.flush()
    except BrokenPipeError:
        # The interpreter flushes once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = READER_LEFT
    raise SystemExit(code or 0)
