"""Every trial of a diagnosis: length, force measured and modelled, and what is left between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.sentences import direction
from xb_muscle_ros.diagnose.written import Trace
from xb_muscle_ros.figures.diagnose_common import (
    BASE,
    WIDTH_MM,
    Array,
    after_name,
    by_activation,
    located_share,
    pages,
    svg,
    thinned,
    trial_labels,
)
from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, figure

_COLUMNS = 3
_PER_PAGE = 9
_HEAD_MM = 7.0
_ROW_MM = 74.0
_TITLE_MM = 4.5
_HEIGHTS_MM = (8.0, 33.0, 15.0)
_LEFT_MM = 18.5
_GAP_MM = 10.0
_PANEL_MM = (WIDTH_MM - _LEFT_MM - 3.0 - (_COLUMNS - 1) * _GAP_MM) / _COLUMNS
_SHADE = "#dfe5ee"
# Shading that covers more of the time than this tells nothing.
_EVERYWHERE = 0.8
_MARK_MM = 2.6
_DASHED = (0, (4, 1.6))


def draw_traces(facts: Mapping[str, Any], traces: Sequence[Trace]) -> list[str]:
    """Pages of at most nine trials, from low to high calcium, as SVG.

    Where mismatch was located the time is shaded (unless that is nearly everywhere: see `shaded`), and marked + where
    the fibre pulls harder than the base model. The residual, measured minus model, has the same scale in all trials.
    """
    rows = facts["trials"]
    order = by_activation(rows)
    limit = _residual_limit(traces)
    spans, labels = shaded(facts, traces), trial_labels(rows)
    drawn = []
    for chosen in pages(order, _PER_PAGE):
        lines = -(-len(chosen) // _COLUMNS)
        height = _HEAD_MM + lines * _ROW_MM
        with figure(WIDTH_MM, height) as made:
            # Panels of the same size at fixed places: rows compare, and many trials draw fast.
            made.set_layout_engine("none")
            handles: dict[str, Any] = {}
            for k, i in enumerate(chosen):
                axes = _place(made, height, k // _COLUMNS, k % _COLUMNS)
                if spans:
                    _spans(axes, facts, rows[i]["trial"], traces[i])
                handles |= _panel(axes, traces[i], after_name(facts))
                axes[0].set_title(labels[str(rows[i]["trial"])], loc="left", fontsize=7, pad=3)
                axes[2].set_ylim(-limit, limit)
                _labels(axes, first=k % _COLUMNS == 0, last=k + _COLUMNS >= len(chosen))
            made.legend(
                handles=list(handles.values()), loc="upper center", ncols=4, frameon=False, bbox_to_anchor=(0.5, 1.0)
            )
            drawn.append(svg(made))
    return drawn


def _place(made: Any, height_mm: float, line: int, column: int) -> tuple[Any, Any, Any]:
    """Axes of one trial: length, force, residual."""
    left = (_LEFT_MM + column * (_PANEL_MM + _GAP_MM)) / WIDTH_MM
    top_mm = _HEAD_MM + line * _ROW_MM + _TITLE_MM
    made_axes: list[Any] = []
    for tall in _HEIGHTS_MM:
        box = (left, 1.0 - (top_mm + tall) / height_mm, _PANEL_MM / WIDTH_MM, tall / height_mm)
        made_axes.append(made.add_axes(box, sharex=made_axes[0] if made_axes else None))
        top_mm += tall + 2.2
    return made_axes[0], made_axes[1], made_axes[2]


def _panel(axes: tuple[Any, Any, Any], trace: Trace, after: str) -> dict[str, Any]:
    top, middle, bottom = axes
    handles: dict[str, Any] = {}
    if trace.length_l0 is not None:
        top.plot(*thinned(trace.time_s, 100.0 * trace.length_l0), color="black", linewidth=0.9)
        top.margins(y=0.12)
    if trace.measured_f0 is not None:
        (handles["measured"],) = middle.plot(
            *thinned(trace.time_s, trace.measured_f0), color=DATA, linewidth=1.0, label="measured"
        )
    bottom.axhline(0.0, color="black", linewidth=0.5)
    for name, values, colour, style, width in _models(trace, after):
        (handles[name],) = middle.plot(
            *thinned(trace.time_s, values), color=colour, linestyle=style, linewidth=width, label=name
        )
        if trace.measured_f0 is not None:
            left = 100.0 * (trace.measured_f0 - values)
            bottom.plot(*thinned(trace.time_s, left), color=colour, linestyle=style, linewidth=width)
    middle.set_ylim(bottom=min(0.0, middle.get_ylim()[0]))
    return handles


def _models(trace: Trace, after_is: str = "") -> list[tuple[str, Array, str, Any, float]]:
    """The base model, and the augmented one where it is another."""
    found: list[tuple[str, Array, str, Any, float]] = []
    before, after = trace.before_f0, trace.after_f0
    if before is not None:
        found.append((BASE, before, SECOND, _DASHED, 1.0))
    if after is not None and (before is None or not np.array_equal(before, after, equal_nan=True)):
        found.append((after_is, after, MODEL, "-", 1.0))
    return found


def shaded(facts: Mapping[str, Any], traces: Sequence[Trace]) -> bool:
    """Whether located mismatch is shaded: not where it covers nearly all of the time."""
    return located_share(facts, traces) <= _EVERYWHERE


def _spans(axes: Sequence[Any], facts: Mapping[str, Any], trial: str, trace: Trace) -> None:
    spans = [row for row in facts["mismatch"] if row["trial"] == trial and None not in (row["start_s"], row["end_s"])]
    mm_per_s = _PANEL_MM / max(float(np.ptp(trace.time_s)), 1e-9)
    last_mm = -np.inf
    for row in sorted(spans, key=lambda row: float(row["start_s"])):
        for axis in axes:
            axis.axvspan(row["start_s"], row["end_s"], facecolor=_SHADE, edgecolor="white", linewidth=1.0)
        middle_s = (row["start_s"] + row["end_s"]) / 2.0
        # A mark that would touch the one before is left out; the table has them all.
        if middle_s * mm_per_s - last_mm < _MARK_MM:
            continue
        last_mm = middle_s * mm_per_s
        mark = {1: "+", -1: "−", 0: "±"}[direction(row)]
        axes[2].text(
            middle_s, 0.99, mark, transform=axes[2].get_xaxis_transform(), ha="center", va="top", fontsize=8,
            fontweight="bold", clip_on=True,
        )  # fmt: skip


def _labels(axes: tuple[Any, Any, Any], first: bool, last: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    top, middle, bottom = axes
    for axis in (top, middle):
        axis.tick_params(labelbottom=False)
    for axis, most in ((top, 2), (middle, 5), (bottom, 4)):
        axis.yaxis.set_major_locator(MaxNLocator(most))
    bottom.xaxis.set_major_locator(MaxNLocator(5))
    for axis in axes:
        axis.tick_params(length=2.5, width=0.6, pad=2, labelsize=7)
    if first:
        top.set_ylabel("ΔL\n(% L$_0$)")
        middle.set_ylabel("Force (F$_0$)")
        bottom.set_ylabel("Residual\n(% F$_0$)")
        for axis in axes:
            axis.yaxis.set_label_coords(-9.8 / _PANEL_MM, 0.5)
    if last:
        bottom.set_xlabel("Time (s)")


def _residual_limit(traces: Sequence[Trace]) -> float:
    """Largest residual of all trials, % F0, with some room above."""
    sizes = [
        100.0 * float(np.nanmax(np.abs(trace.measured_f0 - values)))
        for trace in traces
        if trace.measured_f0 is not None
        for _, values, *_ in _models(trace)
        if np.any(np.isfinite(trace.measured_f0 - values))
    ]
    return 1.35 * max([*sizes, 0.3])
