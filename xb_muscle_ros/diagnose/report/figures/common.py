"""What the figures of a diagnosis share: size, marks of base and answer, labels that may hold anything, and SVG."""

from __future__ import annotations

import io
import itertools
import math
import re
import textwrap
import warnings
import zlib
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.component import Kind
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis, OfTrial
from xb_muscle_ros.plotting.style import DATA_LINE, MODEL, SECOND
from xb_muscle_ros.trials.trial import Array

Key = tuple[str, str]
"""Fibre and trial."""

WIDTH_MM = 178.0
"""Between the margins of an A4 page."""
# Base and answer, as lines and as dots.
LINES: tuple[dict[str, Any], ...] = (
    {"color": SECOND, "linestyle": (0, (4, 1.6)), "linewidth": 1.0, "label": "base model"},
    {"color": MODEL, "linewidth": 1.0, "label": "answer"},
)
DOTS: tuple[dict[str, Any], ...] = (
    {"marker": "o", "markerfacecolor": "white", "markeredgecolor": SECOND, "linestyle": "none", "label": "base model"},
    {"marker": "o", "color": MODEL, "linestyle": "none", "label": "answer"},
)
KIND_LOOKS: Mapping[Kind, dict[str, Any]] = MappingProxyType(
    {
        Kind.MECHANISM: {"facecolor": MODEL, "edgecolor": MODEL},
        Kind.ARTEFACT: {"facecolor": "white", "edgecolor": SECOND, "hatch": "/////"},
    }
)
"""Areas of mechanisms and of artefacts, which are hatched."""
_BINS = 450
_NAME = 26
_CLIP = re.compile(r"\bp[0-9a-f]{10}\b")


class Figure(NamedTuple):
    """A figure as the page has it.

    Attributes:
        svg: self-contained.
        caption: what is to be seen, and what is not shown.
        alternative: in a few words, for those who do not see it.
    """

    svg: str
    caption: str
    alternative: str


def label(text: object, most: int = 200) -> str:
    """Text as Matplotlib may draw it: printable, one line, no mathematics, shortened in the middle."""
    line = re.sub(r"\s+", " ", "".join(c if c.isprintable() else " " for c in str(text))).strip()
    if len(line) > most:
        head = (most - 1) * 2 // 3
        line = f"{line[:head]}…{line[len(line) - (most - 1 - head) :]}"
    return line.replace("\\", "\u29f5").replace("$", r"\$")


def wrapped(text: object, width: int, lines: int = 2) -> str:
    """Text in lines of so many characters, the last one shortened."""
    parts = textwrap.wrap(label(text), width, break_on_hyphens=False)
    if len(parts) > lines:
        parts = [*parts[: lines - 1], label(" ".join(parts[lines - 1 :]), width)]
    return "\n".join(parts)


def key(row: Any) -> Key:
    """Of anything with a fibre and a trial."""
    return row.fibre, row.trial


def trial_labels(d: Diagnosis) -> dict[Key, str]:
    """Every trial with its pCa, and its fibre where there are several: the same in every figure.

    Names go without what all of a fibre begin with, then are shortened in the middle; what is alike is numbered.
    """
    found: dict[Key, str] = {}
    for fibre in dict.fromkeys(t.fibre for t in d.trials):
        rows = [t for t in d.trials if t.fibre == fibre]
        names = _short([label(t.trial, 10_000) for t in rows])
        of = f"{label(fibre, 14)} " if len(d.fibres) > 1 else ""
        found |= {key(t): of + name + _pca(t.pca) for t, name in zip(rows, names, strict=True)}
    return found


def _short(names: list[str]) -> list[str]:
    if len(names) > 1:
        alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))
        shared = names[0][: len(list(alike))]
        shared = shared[: max((shared.rfind(mark) + 1 for mark in "_- ."), default=0)]
        names = [name[len(shared) :] or name for name in names]
    short = [label(name, _NAME) for name in names]
    return [f"{k + 1}: {label(name, _NAME - 4)}" if short.count(name) > 1 else name for k, name in enumerate(short)]


def _pca(value: float | None) -> str:
    if value is None or not math.isfinite(value):
        return ""
    text = f"{value:g}"
    return f"  pCa {text if '.' in text else text + '.0'}"


def by_activation(rows: Sequence[OfTrial]) -> list[OfTrial]:
    """From low to high calcium within each fibre; those without pCa last."""
    order = {fibre: k for k, fibre in enumerate(dict.fromkeys(t.fibre for t in rows))}
    return sorted(rows, key=lambda t: (order[t.fibre], t.pca is None, -(t.pca or 0.0)))


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


def plot_force(axis: Any, t: TrialTraces, models: Iterable[Array]) -> list[Any]:
    """Measured force and what base and, if given, answer make of it, F0; handles for a legend."""
    handles = axis.plot(*thinned(t.time_s, t.measured_f0), **DATA_LINE)
    for values, look in zip(models, LINES, strict=False):
        handles += axis.plot(*thinned(t.time_s, values), **look)
    return list(handles)


def plot_residual(axis: Any, t: TrialTraces, models: Iterable[Array]) -> None:
    """Measured less simulated force, % F0."""
    axis.axhline(0.0, color="black", linewidth=0.5)
    for values, look in zip(models, LINES, strict=False):
        axis.plot(*thinned(t.time_s, 100.0 * (t.measured_f0 - values)), **look)


def same_scale(axes: Any, least: float = 0.0) -> None:
    """One scale around zero for all panels."""
    most = max([least, *(abs(end) for axis in np.ravel(axes) for end in axis.get_ylim())])
    for axis in np.ravel(axes):
        axis.set_ylim(-most, most)


def finite(values: Iterable[float | None]) -> list[float]:
    """Those that are numbers."""
    return [float(v) for v in values if v is not None and math.isfinite(v)]


def quiet_rows(axis: Any) -> None:
    """Rows of dots or bars: faint lines along them, no axis at their side."""
    axis.grid(axis="y", color="#ececec", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.tick_params(axis="y", length=0)
    axis.spines["left"].set_visible(False)


def shown_of(shown: int, total: int, what: str, which: str) -> str:
    """What a figure leaves out, as a sentence; empty where that is nothing."""
    return "" if shown >= total else f" {shown} of {total} {what} shown: {which}."


def unique(handles: Iterable[Any]) -> list[Any]:
    """Handles of a legend, one for each label."""
    return list({handle.get_label(): handle for handle in handles}.values())


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
    drawn = drawn[drawn.index("<svg") :]
    # Clips are named after coordinates whose last bits the layout's solver leaves to chance: here they are numbered,
    # after the figure's own mark, so that figures may stand in one document.
    mark, numbers = f"{zlib.crc32(_CLIP.sub('', drawn).encode()):08x}", dict[str, str]()
    return _CLIP.sub(lambda found: numbers.setdefault(found[0], f"clip-{mark}-{len(numbers)}"), drawn)
