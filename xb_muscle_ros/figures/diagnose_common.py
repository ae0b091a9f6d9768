"""What the figures of a diagnosis share: size, labels that may hold anything, thinned traces, and SVG."""

from __future__ import annotations

import io
import itertools
import re
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

WIDTH_MM = 178.0
"""Between the margins of an A4 page."""
_BINS = 450


def label(text: object, most: int = 200) -> str:
    """Text as Matplotlib may draw it: printable, one line, no mathematics, shortened in the middle."""
    line = re.sub(r"\s+", " ", "".join(c if c.isprintable() else " " for c in str(text))).strip()
    if len(line) > most:
        head = (most - 1) * 2 // 3
        line = f"{line[:head]}…{line[len(line) - (most - 1 - head) :]}"
    return line.replace("\\", "\u29f5").replace("$", r"\$")


BASE = "base model"
"""What every figure and table calls the model with nothing added."""
_NAME = 24


def trial_labels(rows: Iterable[Any]) -> dict[str, str]:
    """Names of trials with their pCa, by name: the same in every figure, and each trial's its own.

    Long names go without what all begin with, then are shortened in the middle; what is still alike is numbered.
    """
    listed = list(rows)
    names = [label(row["trial"], 10_000) for row in listed]
    if max(map(len, names), default=0) > _NAME and len(names) > 1:
        alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
        shared = names[0][: len(list(alike))]
        shared = shared[: max((shared.rfind(mark) + 1 for mark in "_- ."), default=0)]
        names = [f"…{name[len(shared) :]}" if shared else name for name in names]
    short = [label(name, _NAME) for name in names]
    short = [f"{k + 1}: {label(name, _NAME - 4)}" if short.count(name) > 1 else name for k, name in enumerate(short)]
    return {str(row["trial"]): name + _pca(row["pca"]) for row, name in zip(listed, short, strict=True)}


def _pca(value: float | None) -> str:
    if value is None:
        return ""
    text = f"{value:g}"
    return f"  pCa {text if '.' in text else text + '.0'}"


def augmented(facts: Mapping[str, Any]) -> bool:
    """Whether there is another model than the base to show."""
    pairs = (("before_rmsd_f0", "after_rmsd_f0"), ("heldout_before_f0", "heldout_after_f0"))
    return any(row[b] != row[a] and row[a] is not None for row in facts["trials"] for b, a in pairs)


def after_name(facts: Mapping[str, Any]) -> str:
    """What that other model is called: one with a fault of the measurement in it has no new physics."""
    return "corrected model" if facts["verdict"] == "measurement" else "augmented model"


def by_activation(rows: Iterable[Any]) -> list[int]:
    """Places of the trials from low to high calcium; those without pCa last."""
    listed = list(rows)
    return sorted(range(len(listed)), key=lambda i: (listed[i]["pca"] is None, -float(listed[i]["pca"] or 0.0), i))


def thinned(time: Array, values: Array) -> tuple[Array, Array]:
    """Lowest and highest sample of each of 450 spans: what a print can show of a long record, no peak lost."""
    if time.size <= 4 * _BINS:
        return time, values
    edges = np.linspace(0, time.size, _BINS + 1).astype(int)
    keep = {0, time.size - 1}
    for first, last in itertools.pairwise(edges):
        part = values[first:last]
        if np.any(np.isfinite(part)):
            keep |= {int(first + np.nanargmin(part)), int(first + np.nanargmax(part))}
    chosen = np.array(sorted(keep))
    return time[chosen], values[chosen]


def pages(places: list[int], most: int) -> list[list[int]]:
    """Places in pages of so many; only the last may have fewer."""
    return [places[first : first + most] for first in range(0, len(places), most)]


def blocks(count: int, most: int) -> list[slice]:
    """So many things in as few blocks as hold at most that many each, all about as large."""
    parts = np.array_split(np.arange(count), max(-(-count // most), 1))
    return [slice(int(part[0]), int(part[-1]) + 1) for part in parts if part.size]


def located_share(facts: Mapping[str, Any], traces: Iterable[Any]) -> float:
    """Share of the time of all trials in which a mismatch was located."""
    spans = [(row["trial"], row["start_s"], row["end_s"]) for row in facts["mismatch"]]
    inside = whole = 0
    for row, trace in zip(facts["trials"], traces, strict=True):
        hit = np.zeros(trace.time_s.size, dtype=bool)
        for trial, start, end in spans:
            if trial == row["trial"] and start is not None and end is not None:
                hit |= (trace.time_s >= start) & (trace.time_s <= end)
        inside, whole = inside + int(np.count_nonzero(hit)), whole + hit.size
    return inside / whole if whole else 0.0


def svg(made: Any) -> str:
    """A figure as SVG that needs no fonts and is the same for the same data."""
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "path", "svg.hashsalt": "xb_muscle"}), warnings.catch_warnings():
        # Names may be in any script; the page beside the figure spells them in the reader's fonts.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        made.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    drawn = text.getvalue()
    # Without the document type, which names a file elsewhere.
    return drawn[drawn.index("<svg") :]
