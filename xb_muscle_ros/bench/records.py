"""Large recordings: how long import and replay take, and how much memory."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.trials.trial import Array

# Stretch, shortening and pause by turns: times (s) within a cycle, and length there (L0).
_CYCLE_S = 10.0
_CORNERS_S = (0.0, 2.0, 2.05, 2.1, 2.3, 2.35, 9.0, 9.05, _CYCLE_S)
_CORNERS_L0 = (0.0, 0.0, 0.0383, 0.0, 0.0, 0.0383, 0.0383, 0.0, 0.0)
_NOISE_F0 = 3e-3
_COLUMNS = ("time_s", "length_l0", "force_f0")
_LINES = 100_000
# A process of its own, so that its memory is not counted with that of the one who measures. Kilobytes on Linux.
_MEASURED = (
    "import resource, subprocess, sys, time\n"
    "begin = time.perf_counter()\n"
    "done = subprocess.run(sys.argv[1:], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)\n"
    "seconds = time.perf_counter() - begin\n"
    "peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * (1 if sys.platform == 'darwin' else 1024)\n"
    "print(done.stdout[-2000:] if done.returncode else '', seconds, peak, done.returncode, sep='\\n')\n"
)


class Measured(NamedTuple):
    """What a process took: s, and its largest resident memory, MB."""

    seconds: float
    peak_mb: float


class _Recording(NamedTuple):
    """A recording, and the bars of time (s; None where there is none) and memory (MB) for import and replay."""

    name: str
    rate_hz: float
    duration_s: float
    import_s: float | None
    replay_s: float | None
    memory_mb: float | None


_RECORDINGS = (
    _Recording("30 s at 10 kHz", 10_000.0, 30.0, 3.0, 5.0, None),
    _Recording("1 h at 1 kHz", 1000.0, 3600.0, None, None, 500.0),
)


def study(setting: Setting) -> list[Figure]:
    """Time and memory of both commands for both recordings, as CSV with time, length and force."""
    with tempfile.TemporaryDirectory() as folder, Progress(2 * len(_RECORDINGS) + 1, "records") as progress:
        # What is compiled on the first use on a machine is compiled by then.
        both(Path(folder), "first", 1000.0, 3.0, setting.fibre)
        progress.update()
        found: list[Figure] = []
        for k, each in enumerate(_RECORDINGS):
            imported, replayed = both(Path(folder), f"recording_{k}", each.rate_hz, each.duration_s, setting.fibre)
            found += _figures(f"import of {each.name}", imported, each.import_s, each.memory_mb)
            found += _figures(f"replay of {each.name}", replayed, each.replay_s, each.memory_mb)
            progress.update(2)
    return found


def both(folder: Path, name: str, rate_hz: float, duration_s: float, fibre: Fibre) -> tuple[Measured, Measured]:
    """Import and replay of a recording that is made for it.

    Args:
        folder: for all files.
        name: of the recording.
        fibre: replays it.

    Raises:
        UserError: a command fails.
    """
    file, bags = folder / f"{name}.csv", folder / "bags"
    write_recording(file, rate_hz, duration_s)
    command = [sys.executable, "-m", "xb_muscle_ros.cli.main"]
    columns = ["--time-column", _COLUMNS[0], "--length-column", _COLUMNS[1], "--force-column", _COLUMNS[2]]
    units = ["--time-unit", "s", "--length-unit", "L0", "--length-is", "absolute", "--force-unit", "F0"]
    about = ["--pca", "6.1", "--fiber", fibre.name, "--data-set", "made"]
    imported = measured([*command, "import", str(file), "--out", str(bags), *columns, *units, *about])
    which = str(fibre.path or fibre.name)
    out = str(folder / name)
    replayed = measured([*command, "replay", str(bags / f"made_{name}"), "--fiber", which, "--out", out])
    return imported, replayed


def write_recording(file: Path, rate_hz: float, duration_s: float) -> None:
    """A recording as text: time, and length and noisy force of a fibre that is stretched and shortened by turns."""
    random = np.random.default_rng(1)
    with file.open("w", encoding="utf-8") as text:
        text.write(",".join(_COLUMNS) + "\n")
        for time_s in _parts(np.arange(round(rate_hz * duration_s)) / rate_hz):
            change = np.interp(time_s % _CYCLE_S, _CORNERS_S, _CORNERS_L0)
            force = 0.3 + 4.0 * change + _NOISE_F0 * random.standard_normal(time_s.size)
            table = np.column_stack((time_s, 1.0 + change, force))
            np.savetxt(text, table, fmt=("%.5f", "%.9g", "%.9g"), delimiter=",")


def _parts(values: Array) -> Iterator[Array]:
    for first in range(0, values.size, _LINES):
        yield values[first : first + _LINES]


def measured(command: Sequence[str]) -> Measured:
    """Run a command in a process of its own.

    Raises:
        UserError: it fails; with the end of what it said.
    """
    child = [sys.executable, "-c", _MEASURED, *command]
    *said, seconds, peak, code = subprocess.run(child, capture_output=True, text=True, check=True).stdout.splitlines()
    if code != "0":
        raise UserError(f"records: xb_muscle {command[3]} ended with code {code}: {' '.join(said).strip()}")
    return Measured(float(seconds), float(peak) / 1e6)


def _figures(name: str, found: Measured, bar_s: float | None, bar_mb: float | None) -> list[Figure]:
    return [
        Figure(name, found.seconds, "s", "whole process" if bar_s is None else f"whole process; bar {bar_s:g} s"),
        Figure(f"{name}, memory", found.peak_mb, "MB", "largest" if bar_mb is None else f"largest; bar {bar_mb:g} MB"),
    ]
