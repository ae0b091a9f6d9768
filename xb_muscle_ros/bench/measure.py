"""Repeated measurements and how they are written down."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.tables import Columns, aligned, filled, number


@dataclass(frozen=True)
class Figure:
    """One entry of ``bench.json``.

    Attributes:
        name: what was measured.
        value: median of the repeats, or the one value.
        unit: of value and spread.
        compared_with: what the figure should be held against, in words and numbers.
        spread: half the distance between the quartiles of the repeats; None for a single value.
    """

    name: str
    value: float
    unit: str
    compared_with: str
    spread: float | None = None


@dataclass(frozen=True)
class Setting:
    """What studies are asked for.

    Attributes:
        fibre: parameters to measure with.
        out: file of the results; figures are drawn beside it.
        duration_s: of studies of a running node, s.
        rate_hz: of these, Hz; None for each its own.
        priority: ``realtime_priority`` of the node; 0: ordinary.
        fibres: of a node of many.
        ticks: of the soak.
        empirical: table of measured SRS, for the study of peers.
        peers_python: Python with OpenSim; None: where ``scripts/setup_peers`` makes it.
    """

    fibre: Fibre
    out: Path
    duration_s: float = 60.0
    rate_hz: float | None = None
    priority: int = 0
    fibres: int = 100
    ticks: int = 10_000_000
    empirical: Path | None = None
    peers_python: Path | None = None

    def drawing(self, name: str) -> Path:
        """Where a study draws its figure."""
        return self.out.with_name(f"{name}.png")


@contextlib.contextmanager
def counting_down(seconds: float, label: str) -> Iterator[None]:
    """A progress bar beside work that takes a known time."""
    ended = threading.Event()

    def count(progress: Progress) -> None:
        for _ in range(round(seconds)):
            if ended.wait(1.0):
                return
            progress.update()

    with Progress(round(seconds), label) as progress:
        counter = threading.Thread(target=count, args=(progress,))
        counter.start()
        try:
            yield
        finally:
            ended.set()
            counter.join()


def timed(name: str, work: Callable[[], object], repeats: int, unit: str, compared_with: str, calls: int = 1) -> Figure:
    """How long `work` takes, or each of the calls that it makes; one run to warm up."""
    per = calls * {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}[unit]
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append((time.perf_counter() - start) / per)
    low, middle, high = np.percentile(seconds, [25, 50, 75])
    return Figure(name, float(middle), unit, compared_with, float(high - low) / 2.0)


def smooth_and_exact(fibre: Fibre) -> tuple[Muscle, Muscle]:
    """A fibre as it is, and without smoothing."""
    return Muscle(fibre), Muscle(replace(fibre, values={**fibre.values, "smoothing": 0.0}))


def as_text(figures: Sequence[Figure]) -> str:
    """Figures as a table."""
    columns: Columns[Figure] = {
        "measured": lambda f: f.name,
        "median": lambda f: number(f.value, ".4g"),
        "± quartile": lambda f: "" if f.spread is None else f"± {f.spread:.3g}",
        "unit": lambda f: f.unit,
        "compared with": lambda f: f.compared_with,
    }
    return aligned(*filled(columns, figures), left=(0, 2, 3, 4))


def write(path: Path, figures: Sequence[Figure]) -> None:
    """Write ``bench.json``: figures, and what they were measured on."""
    write_json(path, {"machine": machine(), "figures": figures})


def machine() -> dict[str, object]:
    """What the figures were measured on."""
    import os
    import platform

    import numba

    model = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        names = [x.split(":", 1)[1].strip() for x in info.read_text().splitlines() if x.startswith("model name")]
        model = names[0] if names else model
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
