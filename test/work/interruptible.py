"""Run as a script: work that a test interrupts or kills. Arguments: folder for marks, journal, seconds per task."""

from __future__ import annotations

import signal
import sys
import threading
import time
from pathlib import Path

from work_tasks import count

from xb_muscle_ros.work import Options, run

TASKS = 12


def tasks(folder: str, sleep_s: float) -> list[dict[str, object]]:
    """What there is to do."""
    return [{"folder": folder, "i": i, "sleep_s": sleep_s} for i in range(TASKS)]


if __name__ == "__main__":
    # A shell that starts things in the background makes them deaf to interrupts; here they are the point.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Interrupts may be delivered to any thread, and most programs have some.
    threading.Thread(target=time.sleep, args=(60.0,), daemon=True).start()
    try:
        run(count, tasks(sys.argv[1], float(sys.argv[3])), Options(processes=2, journal=Path(sys.argv[2])))
    except KeyboardInterrupt:
        sys.exit(130)
