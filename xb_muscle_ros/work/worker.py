"""A worker process: takes tasks from a pipe, one after another, until the pipe ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from multiprocessing.connection import Connection

from xb_muscle_ros.work.outcome import attempt


def serve(pipe: Connection) -> None:
    """Say that it is there (None), then answer every payload with its outcome.

    An interrupt at the terminal reaches this process too; what is to happen then is the parent's business.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        pipe.send(None)
        while True:
            pipe.send(attempt(pipe.recv_bytes()))
    except (EOFError, OSError):
        # The parent has closed its end, or is no more.
        return


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        # Even in the middle of a task: nobody is left to take its result.
        os._exit(1)
