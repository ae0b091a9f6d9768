"""How well the recordings determine the new parameter: likelihood ratio against its value."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import chi2

from xb_muscle_ros.figures.diagnose_common import label, svg
from xb_muscle_ros.figures.style import MODEL, SHADE, figure

_LEVEL = 0.95


def draw_profile(facts: Mapping[str, Any]) -> list[str]:
    """Profile of the new parameter with its interval, as SVG; none where there is none."""
    profile = facts["profile"]
    points = [p for p in (profile["points"] or ()) if None not in p] if profile else []
    if profile is None or not points:
        return []
    x, root = np.array(sorted(points), dtype=np.float64).T
    limit = float(np.sqrt(chi2.ppf(_LEVEL, 1)))
    from matplotlib.ticker import MaxNLocator

    with figure(100.0, 60.0) as made:
        axes = made.add_subplot()
        low, high = profile["interval"] or (None, None)
        if low is not None and high is not None:
            axes.axvspan(low, high, color=SHADE, linewidth=0)
            for end in (low, high):
                axes.axvline(end, color="black", linewidth=0.6)
        axes.axhline(limit, color="black", linewidth=0.6, linestyle=":")
        axes.text(1.0, limit, " 95 %", transform=axes.get_yaxis_transform(), va="center", fontsize=7)
        axes.plot(x, root, color=MODEL, marker="o", markersize=3)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_ylim(-0.1, max(1.6 * limit, min(float(root.max()) * 1.05, 3.0 * limit)))
        unit = "" if profile["unit"] in (None, "", "1") else f" ({label(profile['unit'], 20)})"
        axes.set_xlabel(f"{label(profile['parameter'], 40)}{unit}")
        axes.set_ylabel("√(likelihood ratio)")
        return [svg(made)]
