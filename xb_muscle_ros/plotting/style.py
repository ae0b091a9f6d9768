"""One look for all figures: readable in print, in grey and by colour-blind readers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import MappingProxyType
from typing import Any

from xb_muscle_ros.files import replaced

# Data are grey, models dark: told apart without colour. Hues after Okabe and Ito.
DATA = "#9a9a9a"
MODEL = "#0b4f8a"
SECOND = "#c1440e"
THIRD = "#117a55"
SHADE = "#e9edf2"
DATA_LINE: Mapping[str, Any] = MappingProxyType(
    {"color": DATA, "linewidth": 1.8, "label": "measured", "solid_capstyle": "round"}
)
"""A measured trace: broader than a model's, so that it shows on both sides of one that lies on it."""


_KEPT: ContextVar[list[Any] | None] = ContextVar("kept", default=None)


@contextmanager
def kept() -> Iterator[list[Any]]:
    """Figures that are drawn within the block, in order, each labelled with the name of the file that it would be.

    They are handed to whoever asked for them, and not written.
    """
    figures: list[Any] = []
    token = _KEPT.set(figures)
    try:
        yield figures
    finally:
        _KEPT.reset(token)


@contextmanager
def figure(width_mm: float, height_mm: float) -> Iterator[Any]:
    """A Matplotlib figure in the common style.

    It is none of pyplot's: a notebook keeps its backend, and nothing has to be closed.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    settings: Any = {
        "font.size": 8,
        "axes.labelsize": 8,
        "axes.titlesize": 8,
        "legend.fontsize": 7.5,
        "xtick.labelsize": 7.5,
        "ytick.labelsize": 7.5,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.linewidth": 0.7,
        "lines.linewidth": 1.2,
        "figure.dpi": 100,
        "savefig.dpi": 200,
        "pdf.fonttype": 42,
        "svg.fonttype": "none",
    }
    with mpl.rc_context(settings):
        made = Figure(figsize=(width_mm / 25.4, height_mm / 25.4), layout="constrained")
        FigureCanvasAgg(made)
        yield made
        figures = _KEPT.get()
        if figures is not None:
            # Ticks take their look from the settings when they are first drawn.
            made.draw_without_rendering()
            figures.append(made)


def save(made: Any, path: Path) -> None:
    """Save as PNG and, beside it, as PDF."""
    if _KEPT.get() is not None:
        made.set_label(path.stem)
        return
    for suffix in (".png", ".pdf"):
        with replaced(path.with_suffix(suffix)) as temporary:
            made.savefig(temporary)
