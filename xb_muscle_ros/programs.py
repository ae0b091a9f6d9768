"""How every program of this package ends."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

_READER_LEFT = 141


def run(program: Callable[[], int], reader_left: int = _READER_LEFT) -> None:
    """Run a program and exit with its code, quietly where whoever read its output has left.

    Args:
        program: returns the code.
        reader_left: code for that case; by default that of a program which the system ends for it, because its
            work may be half done.

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
        code = reader_left
    raise SystemExit(code)
