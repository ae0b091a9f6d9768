"""How long a process takes from nothing to the first step, with the compiled model on disk."""

from __future__ import annotations

import subprocess
import sys

from xb_muscle_ros.bench.measure import Figure, Setting, timed

_SCRIPT = (
    "from xb_muscle_ros.models.fibre_file import load_fibre\n"
    "from xb_muscle_ros.models.muscle import Muscle\n"
    "m = Muscle(load_fibre('18Dec2017a'))\n"
    "m.step(m.rest(), 0.0, 1.0, 1e-3)\n"
)


def study(setting: Setting) -> list[Figure]:
    """Time of a whole Python process that imports the package, loads a fibre and steps once."""
    del setting  # always of the same fibre
    command = [sys.executable, "-c", _SCRIPT]
    name, asked = "import and first step, warm cache", "the whole process; 1.5 s were asked for"
    return [timed(name, lambda: subprocess.run(command, check=True), 7, "s", asked)]
