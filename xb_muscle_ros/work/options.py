"""Where work is done and what is kept of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

# What JSON can hold; what comes back has lists for sequences and dicts for mappings.
JsonValue: TypeAlias = "bool | int | float | str | Sequence[JsonValue] | Mapping[str, JsonValue] | None"


@dataclass(frozen=True)
class Options:
    """Where work is done and what is kept of it; results do not depend on it.

    Attributes:
        scheduler: address of a Dask scheduler (``tcp://host:8786``); None for processes of this machine.
        processes: how many processes of this machine; None for one per core this process may use, 0 for this very
            process (to debug or profile a task; it may have several threads for linear algebra, which then may differ
            from that of workers in the last digit).
        journal: file that keeps finished results; a later run takes them from there. Made if need be.
        label: shown before the progress bar.
        quiet: nothing on stderr.
    """

    scheduler: str | None = None
    processes: int | None = None
    journal: Path | None = None
    label: str = ""
    quiet: bool = False
