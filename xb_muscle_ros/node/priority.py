"""Fixed priority for threads, where the system permits it."""

from __future__ import annotations

import os

from xb_muscle_ros.node.status import Log


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
