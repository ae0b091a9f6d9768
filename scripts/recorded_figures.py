"""Figure of one case: training trials above, held-out trials below; data, base, answer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from recorded_tables import predicted_rows

from xb_muscle_ros.diagnose import outputs
from xb_muscle_ros.diagnose.report.traces import TrialTraces, read_traces
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure

Array = npt.NDArray[np.float64]

_COLUMNS = 4
# Of a study with more trials than this, those are drawn whose difference is typical of every part of its range.
_MOST_SHOWN = 12


class _Panel(NamedTuple):
    """One trial: title, times (s) and forces (F0); `after` is None where the answer has no mechanism."""

    title: str
    time_s: Array
    measured_f0: Array
    before_f0: Array
    after_f0: Array | None


def write_figure(folder: Path, path: Path) -> Path:
    """Draw a case's traces from what was written into its folder; returns the path."""
    d = outputs.read(folder)
    several = len(d.fibres) > 1
    training = [_of_training(t, several, bool(d.named)) for t in _typical(read_traces(folder / outputs.TRACES))]
    with np.load(folder / "predictions.npz") as arrays:
        hidden = [_of_held_out(arrays, k, row, several) for k, row in enumerate(predicted_rows(folder))]
    above, below = math.ceil(len(training) / _COLUMNS), math.ceil(len(hidden) / _COLUMNS)
    with figure(180.0, 42.0 * (above + below) + 8.0) as made:
        axes = made.subplots(above + below, _COLUMNS, squeeze=False)
        panels: list[_Panel | None] = [*training, *[None] * (above * _COLUMNS - len(training)), *hidden]
        for ax, panel in zip(axes.flat, [*panels, *[None] * (axes.size - len(panels))], strict=True):
            if panel is None:
                ax.axis("off")
            else:
                _draw(ax, panel)
        for ax in axes[:, 0]:
            ax.set_ylabel("force (F0)")
        for column in range(_COLUMNS):
            lit = [ax for ax in axes[:, column] if ax.axison]
            if lit:
                lit[-1].set_xlabel("time (s)")
        labels = ["measured", "base model", "answer"]
        made.legend(axes[0, 0].lines, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=6.5)
        path.parent.mkdir(parents=True, exist_ok=True)
        made.savefig(path, dpi=130)
    return path


def _typical(traces: Sequence[TrialTraces]) -> list[TrialTraces]:
    """At most `_MOST_SHOWN` trials, evenly over their order by the base's difference, in the order of recording."""
    if len(traces) <= _MOST_SHOWN:
        return list(traces)
    size = [float(np.mean((t.before_f0 - t.measured_f0) ** 2)) for t in traces]
    order = np.argsort(size)
    kept = {int(order[k]) for k in np.linspace(0, len(traces) - 1, _MOST_SHOWN).round().astype(int)}
    return [t for i, t in enumerate(traces) if i in kept]


def _of_training(t: TrialTraces, several: bool, named: bool) -> _Panel:
    title = f"{t.fibre}\n{t.trial}" if several else t.trial
    return _Panel(title, t.time_s, t.measured_f0, t.before_f0, t.after_f0 if named else None)


def _of_held_out(arrays: Any, k: int, row: dict[str, Any], several: bool) -> _Panel:
    name = row["trial"].split("_trial")[-1] if "_trial" in row["trial"] else row["trial"]
    title = f"held out: {row['tests']}\n{row['fibre']} {name}" if several else f"held out: {row['tests']}\n{name}"
    after = arrays.get(f"p{k}_after_f0")
    times = arrays[f"p{k}_time_s"]
    return _Panel(title, times, arrays[f"p{k}_measured_f0"], arrays[f"p{k}_before_f0"], after)


def _draw(ax: Any, panel: _Panel) -> None:
    ax.plot(panel.time_s, panel.measured_f0, color=DATA, linewidth=2.6)
    ax.plot(panel.time_s, panel.before_f0, color=SECOND, linewidth=0.9, linestyle="--")
    if panel.after_f0 is not None:
        ax.plot(panel.time_s, panel.after_f0, color=MODEL, linewidth=0.9)
    ax.set_title(panel.title, fontsize=6.0, loc="left")
