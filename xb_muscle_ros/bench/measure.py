"""Repeated measurements and how they are written down."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xb_muscle_ros.files import write_json
from xb_muscle_ros.tables import Columns, aligned, filled, number


@dataclass(frozen=True)
class Figure:
    """One entry of ``bench.json``.

    Attributes:
        name: what was measured.
        value: median of the repeats, or the one value.
        unit: of value and spread.
        spread: half the distance between the quartiles of the repeats; None for a single value.
        compared_with: what the figure should be held against, in words and numbers.
    """

    name: str
    value: float
    unit: str
    spread: float | None
    compared_with: str


def timed(work: Callable[[], object], repeats: int, per: float = 1.0) -> tuple[float, float]:
    """Median and half quartile distance of the seconds that `work` takes, divided by `per`; one run to warm up."""
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append((time.perf_counter() - start) / per)
    low, middle, high = np.percentile(seconds, [25, 50, 75])
    return float(middle), float(high - low) / 2.0


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


def write(path: Path, figures: Sequence[Figure], machine: dict[str, object]) -> None:
    """Write figures to ``bench.json``."""
    write_json(path, {"machine": machine, "figures": figures})


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
