"""Angle, force and stiffness of a body in the loop with its muscle, the first 100 ms magnified."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.plant.loop import Trace
from xb_muscle_ros.plant.report import rows
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, SHADE, THIRD, figure, save

_FIRST_S = 0.1
LOOKS: tuple[dict[str, Any], ...] = (
    {"color": MODEL, "linestyle": "-", "linewidth": 1.6},
    {"color": SECOND, "linestyle": (0, (5, 1.5)), "linewidth": 1.4},
    {"color": THIRD, "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.4},
    {"color": DATA, "linestyle": "-", "linewidth": 2.6, "zorder": 1.5},
    {"color": "black", "linestyle": (0, (1, 1.2)), "linewidth": 1.6},
)
_MARKED = {"markersize": 3.0, "markerfacecolor": "white", "markeredgewidth": 0.7}
_MARKERS = {(True, False): "o", (False, True): "^", (True, True): "s"}
"""By whether the leg was moved before, and whether there is a reflex."""


def draw_loop(path: Path, traces: Sequence[Trace], title: str) -> None:
    """Draw angle and force of the first muscle over time, torque over angle, and a table of the main numbers.

    Above the whole run, below its first 100 ms. Where all start standing, force and torque are changes.

    Args:
        path: PNG; a PDF goes beside it.
        traces: of one scene.
        title: what was done.
    """
    standing = traces[0].scene == "ankle"
    angle_label = "Sway (°)" if standing else "Knee flexion (°)"
    force_label = "Soleus force, change (N)" if standing else "Force of the vasti (N)"
    torque_label = "Ankle torque, change (N·m)" if standing else "Knee torque (N·m)"
    labels = ((angle_label, "Time (s)"), (force_label, "Time (s)"), (torque_label, angle_label))
    with figure(190.0, 122.0 + 4.5 * len(traces)) as made:
        grid = made.add_gridspec(3, 3, height_ratios=(1.0, 1.0, 0.1 + 0.11 * len(traces)))
        panels = [[made.add_subplot(grid[row, column]) for column in range(3)] for row in range(2)]
        for trace, look in zip(traces, _looks(traces), strict=True):
            angle = np.degrees(trace.angle_rad - trace.angle_rad[0])
            force = trace.force_n[:, 0] - (trace.force_n[0, 0] if standing else 0.0)
            torque = trace.torque_nm - (trace.torque_nm[0] if standing else 0.0)
            for row, count in enumerate((trace.time_s.size, int(np.searchsorted(trace.time_s, _FIRST_S + 1e-9)))):
                for axes, x, y in zip(
                    panels[row], (trace.time_s, trace.time_s, angle), (angle, force, torque), strict=True
                ):
                    axes.plot(x[:count], y[:count], label=trace.label, markevery=max(1, count // 9), **look)
        _load_line(panels, traces[0])
        for row in range(2):
            for column, (upward, along) in enumerate(labels):
                axes = panels[row][column]
                axes.set_ylabel(upward)
                axes.set_xlabel(along)
                axes.set_title("abcdef"[3 * row + column], loc="left", fontweight="bold")
                if row == 0 and column < 2:
                    axes.axvspan(0.0, _FIRST_S, color=SHADE, linewidth=0)
                if row == 1:
                    axes.set_facecolor(SHADE)
        handles, names = panels[1][2].get_legend_handles_labels()
        columns = len(names) if len(names) <= 5 else 4
        made.legend(
            handles, names, loc="outside upper center", ncols=columns, frameon=False, title=title, handlelength=3.2
        )
        _table(made.add_subplot(grid[2, :]), *rows(traces))
        save(made, path)


def _looks(traces: Sequence[Trace]) -> list[dict[str, Any]]:
    """One line for each model; a run that was moved before or has a reflex has its model's line, with markers."""
    models = list(dict.fromkeys(trace.model for trace in traces))
    made = []
    for trace in traces:
        marker = _MARKERS.get((trace.moved_before, trace.reflex))
        marked = {"marker": marker, **_MARKED} if marker else {}
        made.append({**LOOKS[models.index(trace.model) % len(LOOKS)], **marked})
    return made


def _load_line(panels: list[list[Any]], trace: Trace) -> None:
    """The stiffness that would just carry the load, where the load itself is not stable."""
    if trace.load_nm_per_rad <= 1e-6:
        return
    for row in range(2):
        axes = panels[row][2]
        right = axes.get_xlim()[1]
        slope = trace.load_nm_per_rad * np.pi / 180.0
        axes.autoscale(False)
        axes.plot((0.0, right), (0.0, slope * right), color="black", linewidth=0.7, label="m·g·h", zorder=1.0)


def _table(axes: Any, head: Sequence[str], cells: Sequence[Sequence[str]]) -> None:
    axes.set_axis_off()
    heads = [name.replace(" [", "\n[") if name.count(" ") < 3 else name.replace(" ", "\n", 1) for name in head]
    made = axes.table(cellText=cells, colLabels=heads, cellLoc="center", loc="center", edges="horizontal")
    made.auto_set_font_size(False)
    made.set_fontsize(6.5)
    made.auto_set_column_width(list(range(len(heads))))
    for (row, _), cell in made.get_celld().items():
        cell.set_linewidth(0.4)
        if row == 0:
            cell.set_height(cell.get_height() * 2.0)
