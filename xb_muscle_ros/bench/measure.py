"""Repeated measurements and how they are written down."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from xb_muscle_ros.files import write_text


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
    lines = []
    for f in figures:
        spread = "" if f.spread is None else f" ± {f.spread:.3g}"
        lines.append(f"{f.name:58s} {f.value:>10.4g}{spread:<12s} {f.unit:6s} {f.compared_with}")
    return "\n".join(lines)


def write(path: Path, figures: Sequence[Figure], machine: dict[str, object]) -> None:
    """Write figures to ``bench.json``."""
    tree = {"machine": machine, "figures": [asdict(figure) for figure in figures]}
    write_text(path, json.dumps(tree, indent=1) + "\n")


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
