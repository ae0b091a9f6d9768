"""One look for all figures: readable in print, in grey and by colour-blind readers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from xb_muscle_ros.files import replaced

# Data are grey, models dark: told apart without colour. Hues after Okabe and Ito.
DATA = "#9a9a9a"
MODEL = "#0b4f8a"
SECOND = "#c1440e"
THIRD = "#117a55"
SHADE = "#e9edf2"


@contextmanager
def figure(width_mm: float, height_mm: float) -> Iterator[Any]:
    """A Matplotlib figure in the common style, closed afterwards."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

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
        made = plt.figure(figsize=(width_mm / 25.4, height_mm / 25.4), layout="constrained")
        try:
            yield made
        finally:
            plt.close(made)


def save(made: Any, path: Path) -> None:
    """Save as PNG and, beside it, as PDF."""
    for suffix in (".png", ".pdf"):
        with replaced(path.with_suffix(suffix)) as temporary:
            made.savefig(temporary)
