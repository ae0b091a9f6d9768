"""What a realtime process asks of the system, and goes on without where that is not permitted: priority, memory."""

from __future__ import annotations

import ctypes
import os
import sys

from xb_muscle_ros.node.status import Log

_MCL_CURRENT, _MCL_FUTURE = 1, 2


def lock_memory(log: Log) -> None:
    """Lock all pages, so that no tick waits for the disk, where no limit is set those to come as well.

    Where that is not permitted, say so and go on.
    """
    why = "only Linux is known to"
    if sys.platform.startswith("linux"):
        import resource

        libc = ctypes.CDLL(None, use_errno=True)
        # Within a limit, pages to come would be refused once it is reached, and the process with them.
        limited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != resource.RLIM_INFINITY
        if libc.mlockall(_MCL_CURRENT if limited else _MCL_CURRENT | _MCL_FUTURE) == 0:
            log.info("memory is locked" + (", but not what is allocated from now on ('ulimit -l')" if limited else ""))
            return
        why = os.strerror(ctypes.get_errno())
    log.warning(
        f"lock_memory is not permitted here ({why}): memory stays as it is; allow it with 'ulimit -l unlimited', a "
        "memlock line in limits.conf or CAP_IPC_LOCK"
    )


def unlock_memory() -> None:
    """Let pages go again."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).munlockall()


def take_priority(priority: int, log: Log) -> bool:
    """Put the calling thread under SCHED_FIFO; where that is not permitted, say so and go on. Whether it is."""
    try:
        # 0 is the calling thread, on Linux.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (AttributeError, OSError) as error:
        log.warning(
            f"realtime_priority {priority} is not permitted here ({error}): ordinary scheduling goes on; allow it with "
            "'ulimit -r', an rtprio line in limits.conf or CAP_SYS_NICE"
        )
        return False
    return True


def drop_priority() -> None:
    """Put the calling thread back under ordinary scheduling."""
    if hasattr(os, "sched_setscheduler") and os.sched_getscheduler(0) == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
