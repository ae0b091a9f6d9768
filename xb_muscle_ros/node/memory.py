"""Keep the process in memory, so that no tick waits for the disk."""

from __future__ import annotations

import ctypes
import os
import sys

from xb_muscle_ros.node.status import Log

_MCL_CURRENT, _MCL_FUTURE = 1, 2


def lock_memory(log: Log) -> None:
    """Lock all pages, where no limit is set those to come as well; where that is not permitted, say so and go on."""
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
