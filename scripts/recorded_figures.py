"""Figure of one case: what the diagnosis was shown above, what was concealed below; data, base, best explanation."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, figure

_COLUMNS = 4


def write_figure(folder: Path, path: Path) -> Path:
    """Draw a case's traces from what was written into its folder; returns the path."""
    facts = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    found = json.loads((folder / "predictions.json").read_text(encoding="utf-8"))
    shown = [(row["trial"], "shown") for row in facts["trials"]]
    hidden = [(row["trial"], row["tests"]) for row in found["concealed"]]
    above, below = math.ceil(len(shown) / _COLUMNS), math.ceil(len(hidden) / _COLUMNS)
    with (
        np.load(folder / "predictions.npz") as unseen,
        figure(180.0, 42.0 * (above + below) + 8.0) as made,
    ):
        axes = made.subplots(above + below, _COLUMNS, squeeze=False)
        panels = [(unseen, f"s{k}", *names) for k, names in enumerate(shown)]
        panels += [(unseen, "", "", "")] * (above * _COLUMNS - len(panels))
        panels += [(unseen, f"p{k}", *names) for k, names in enumerate(hidden)]
        for ax, panel in zip(axes.flat, [*panels, *[(unseen, "", "", "")] * (axes.size - len(panels))], strict=True):
            if panel[1]:
                _panel(ax, *panel)
            else:
                ax.axis("off")
        for ax in axes[:, 0]:
            ax.set_ylabel("force (F0)")
        for column in range(_COLUMNS):
            lit = [ax for ax in axes[:, column] if ax.axison]
            if lit:
                lit[-1].set_xlabel("time (s)")
        named = "" if facts["answer"] else " (not named)"
        labels = ["measured", "base model", f"best explanation{named}"]
        made.legend(axes[0, 0].lines, labels, loc="outside upper center", ncols=3, frameon=False, fontsize=6.5)
        path.parent.mkdir(parents=True, exist_ok=True)
        made.savefig(path, dpi=130)
    return path


def _panel(ax: Any, arrays: Any, key: str, trial: str, tests: str) -> None:
    time = arrays[f"{key}_time_s"]
    ax.plot(time, arrays[f"{key}_measured_f0"], color=DATA, linewidth=2.6)
    ax.plot(time, arrays[f"{key}_before_f0"], color=SECOND, linewidth=0.9, linestyle="--")
    ax.plot(time, arrays[f"{key}_after_f0"], color=MODEL, linewidth=0.9)
    name = trial.split("_trial")[-1] if "_trial" in trial else trial
    ax.set_title(f"{name}\n{tests}" if tests != "shown" else name, fontsize=6.5, loc="left")
