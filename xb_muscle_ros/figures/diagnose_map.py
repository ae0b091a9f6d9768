"""Where the model fails: residual over trials and phases, of the base and of the augmented model side by side."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.sentences import ONE_WAY
from xb_muscle_ros.diagnose.significance import ALPHA, FLOOR_F0
from xb_muscle_ros.diagnose.words import percent, phase_words
from xb_muscle_ros.figures.diagnose_common import (
    BASE,
    WIDTH_MM,
    Array,
    after_name,
    blocks,
    by_activation,
    label,
    pages,
    svg,
    trial_labels,
)
from xb_muscle_ros.figures.style import figure

_PER_PAGE = 24
# Columns in which numbers have room: side by side with another map, and over the whole width.
_BESIDE, _ACROSS = 7, 14
# Below this lightness of a cell its numbers are white.
_DARK = 0.5
# Smaller differences matter to nobody, so they do not get the strongest colours (% F0).
_FLOOR = 0.3


class Part(NamedTuple):
    """What one panel shows of a map.

    Attributes:
        title: above it.
        table: the map.
        columns: of its phases.
    """

    title: str
    table: Mapping[str, Any]
    columns: slice


def draw_map(facts: Mapping[str, Any]) -> list[str]:
    """Pages of at most 24 trials, from low to high calcium, as SVG; none where there is no map.

    Colour and upper number are the mean residual of the cell, the lower number its root mean square, both in % F0. A
    heavy frame marks cells that count (see `framed`). Both models stand side by side where numbers have room;
    else each has pages of its own, with as many phases as there is room for.
    """
    maps = {title: table for title, table in _maps(facts).items() if table and table["trials"] and table["phases"]}
    if not maps:
        return []
    first, *others = maps.values()
    if others and others[0]["rms_f0"] == first["rms_f0"]:
        del maps[after_name(facts)]
    pca_of = {row["trial"]: row["pca"] for row in facts["trials"]}
    rows = [{"trial": name, "pca": pca_of.get(name)} for name in first["trials"]]
    labels = trial_labels(rows)
    limit = max([_FLOOR, *(float(np.nanmax(np.abs(m))) for m in map(_means, maps.values()) if np.any(np.isfinite(m)))])
    drawn = []
    for parts in _figures(maps):
        for chosen in pages(by_activation(rows), _PER_PAGE):
            names = [rows[i]["trial"] for i in chosen]
            columns = sum(part.columns.stop - part.columns.start for part in parts)
            width = WIDTH_MM if columns > _BESIDE else 0.66 * WIDTH_MM
            with figure(width, 33.0 + 6.8 * len(chosen)) as made:
                axes = made.subplots(1, len(parts), squeeze=False, sharey=True)[0]
                image = None
                for axis, part in zip(axes, parts, strict=True):
                    image = _cells(axis, part, names, limit, framed(facts))
                    axis.set_title(part.title, loc="left")
                axes[0].set_yticks(range(len(chosen)), [labels[str(rows[i]["trial"])] for i in chosen], fontsize=6.5)
                bar = made.colorbar(image, ax=list(axes), location="bottom", shrink=0.45, aspect=40, pad=0.02)
                bar.set_label("mean of measured minus model (% F$_0$)")
                bar.outline.set_visible(False)
                drawn.append(svg(made))
    return drawn


def framed(facts: Mapping[str, Any]) -> bool:
    """Whether cells that count are framed: not where all do, as a frame around everything tells nothing."""
    known = [counted(table) for table in _maps(facts).values() if table and table["trials"] and table["phases"]]
    return not all(bool(np.all(cells[np.isfinite(cells)] == 1.0)) for cells in known)


def counted(table: Mapping[str, Any]) -> Array:
    """Which cells stand out beyond chance and are large enough to count (1 or 0); NaN where there is none."""
    shape = (len(table["trials"]), len(table["phases"]))
    rms, p_value = (_array(table[key], *shape) for key in ("rms_f0", "p_value"))
    counts = (p_value < ALPHA) & (rms > FLOOR_F0)
    if table.get("counts"):
        counts = np.array([[bool(c) for c in row] for row in table["counts"]])
    return np.where(np.isfinite(rms), counts, np.nan)


def _maps(facts: Mapping[str, Any]) -> dict[str, Any]:
    return {BASE: facts["map"], after_name(facts): facts["map_after"]}


def _figures(maps: Mapping[str, Any]) -> list[list[Part]]:
    """Panels of each figure."""
    most = max(len(table["phases"]) for table in maps.values())
    if len(maps) > 1 and most <= _BESIDE:
        return [[Part(title, table, slice(0, len(table["phases"]))) for title, table in maps.items()]]
    found = []
    for title, table in maps.items():
        count = len(table["phases"])
        for part in blocks(count, _ACROSS):
            of = "" if part.stop - part.start == count else f", phases {part.start + 1} to {part.stop} of {count}"
            found.append([Part(f"{title}{of}", table, part)])
    return found


def _means(table: Mapping[str, Any]) -> Array:
    return 100.0 * _array(table["mean_f0"], len(table["trials"]), len(table["phases"]))


def _array(cells: Any, rows: int, columns: int) -> Array:
    """Cells with NaN for None; all NaN where there are none."""
    if not cells:
        return np.full((rows, columns), np.nan)
    return np.array([[np.nan if c is None else float(c) for c in row] for row in cells])


def _cells(axis: Any, part: Part, names: list[str], limit: float, frames: bool) -> Any:
    table, columns = part.table, part.columns
    places = {name: i for i, name in enumerate(table["trials"])}
    shape = (len(table["trials"]), len(table["phases"]))
    # A trial that this map does not know gets the empty row at the end.
    take = [places.get(name, len(places)) for name in names]
    mean, rms = (
        100.0 * np.vstack([_array(table[key], *shape), np.full(shape[1], np.nan)])[take][:, columns]
        for key in ("mean_f0", "rms_f0")
    )
    counts = np.vstack([counted(table), np.full(shape[1], np.nan)])[take][:, columns]
    edges = [np.arange(n + 1) - 0.5 for n in mean.shape]
    image = axis.pcolormesh(
        edges[1], edges[0], mean, cmap=_colours(), vmin=-limit, vmax=limit, edgecolors="white", linewidth=0.6
    )
    axis.set_ylim(mean.shape[0] - 0.5, -0.5)
    for i, j in np.ndindex(mean.shape):
        _cell(axis, i, j, (float(mean[i, j]), float(rms[i, j])), counts[i, j] == 1.0, frames, limit)
    axis.set_xticks(
        range(mean.shape[1]),
        [label(phase_words(str(p)), 24) for p in table["phases"][columns]],
        rotation=35,
        ha="right",
        fontsize=6.5,
    )
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    return image


def _cell(axis: Any, i: int, j: int, values: tuple[float, float], counts: bool, frames: bool, limit: float) -> None:
    """Numbers, frame or hatching of one cell."""
    from matplotlib.patches import Rectangle

    mean, rms = values
    if not np.isfinite(mean) and not np.isfinite(rms):
        box = (j - 0.5, i - 0.5)
        axis.add_patch(Rectangle(box, 1.0, 1.0, facecolor="#f2f2f2", edgecolor="#c4c4c4", hatch="////", linewidth=0))
        return
    red, green, blue, _ = _colours()(0.5 + 0.5 * mean / limit if np.isfinite(mean) else 0.5)
    colour = "white" if 0.299 * red + 0.587 * green + 0.114 * blue < _DARK else "black"
    if np.isfinite(mean):
        axis.text(j, i - 0.17, _signed(mean, limit), ha="center", va="center", fontsize=6.5, color=colour)
    if np.isfinite(rms):
        both = abs(mean) < ONE_WAY * rms and counts
        axis.text(
            j, i + 0.26, ("±" if both else "") + percent(rms / 100.0), ha="center", va="center", color=colour,
            fontsize=5.0, fontweight="bold" if both else "normal",
        )  # fmt: skip
    if counts and frames:
        frame = (j - 0.47, i - 0.45)
        axis.add_patch(Rectangle(frame, 0.94, 0.9, fill=False, edgecolor="black", linewidth=1.1))


@cache
def _colours() -> Any:
    """Violet over white to orange, without the ends in which both are black."""
    import matplotlib as mpl

    return mpl.colors.ListedColormap(mpl.colormaps["PuOr_r"](np.linspace(0.1, 0.9, 256)))


def _signed(value_percent: float, limit: float) -> str:
    """With as many digits in all cells as the largest needs."""
    text = f"{value_percent:+.{1 if limit >= 10.0 else 2}f}"
    return text.replace("-", "−") if float(text) else "0"
