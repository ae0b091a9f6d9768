"""Error of every trial before and after, fitted and left out, between the noise and what a flexible curve reaches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.figures.diagnose_common import BASE, WIDTH_MM, after_name, by_activation, pages, svg, trial_labels
from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, THIRD, figure

_PER_PAGE = 30
_PANELS = (
    ("fitted", "before_rmsd_f0", "after_rmsd_f0", "train_rmsd_f0"),
    ("left out of the fit", "heldout_before_f0", "heldout_after_f0", "heldout_rmsd_f0"),
)


def draw_trials(facts: Mapping[str, Any]) -> list[str]:
    """Pages of at most 30 trials, from low to high calcium, as SVG; none where no error is known."""
    rows = facts["trials"]
    panels = [panel for panel in _PANELS if any(row[key] is not None for row in rows for key in panel[1:3])]
    if not panels:
        return []
    name, labels = after_name(facts), trial_labels(rows)
    drawn = []
    for number, chosen in enumerate(pages(by_activation(rows), _PER_PAGE)):
        shown = [rows[i] for i in chosen]
        with figure(WIDTH_MM, 30.0 + 5.4 * (len(shown) + 1)) as made:
            axes = made.subplots(1, len(panels), squeeze=False, sharey=True, sharex=True)[0]
            handles: dict[str, Any] = {}
            for axis, (title, before, after, overall) in zip(axes, panels, strict=True):
                total = {before: facts["before"][overall], after: facts["after"][overall], "noise_sd_f0": None}
                for place, row in enumerate([total, *shown] if number == 0 else shown):
                    handles |= _row(axis, place, row, before, after, name, heavy=row is total)
                if title != "fitted" and facts["flexible_bound_rmsd_f0"] is not None:
                    handles["flexible"] = axis.axvline(
                        100.0 * facts["flexible_bound_rmsd_f0"], color=THIRD, linewidth=1.0, linestyle=(0, (1, 1.5)),
                        label="flexible curve, all trials", zorder=0,
                    )  # fmt: skip
                axis.set_title(f"trials {title}", loc="left")
                axis.set_xlabel("Force RMSD (% F$_0$)")
                axis.grid(axis="y", color="#ececec", linewidth=0.6)
                axis.set_axisbelow(True)
                axis.tick_params(axis="y", length=0)
                axis.spines["left"].set_visible(False)
            names = (["all trials"] if number == 0 else []) + [labels[str(row["trial"])] for row in shown]
            axes[0].set_yticks(range(len(names)), names, fontsize=6.5)
            axes[0].set_ylim(len(names) - 0.4, -0.6)
            axes[0].set_xlim(0.0, 1.06 * axes[0].get_xlim()[1])
            made.legend(handles=list(handles.values()), loc="outside upper center", ncols=4, frameon=False)
            drawn.append(svg(made))
    return drawn


def _row(
    axis: Any, place: int, row: Mapping[str, Any], before: str, after: str, after_is: str, heavy: bool
) -> dict[str, Any]:
    handles: dict[str, Any] = {}
    size = 6.0 if heavy else 4.5
    if row[before] is not None and row[after] is not None:
        axis.plot([100.0 * row[before], 100.0 * row[after]], [place, place], color=DATA, linewidth=1.2, zorder=1)
    if row[before] is not None:
        (handles["before"],) = axis.plot(
            [100.0 * row[before]], [place], "o", markersize=size, markerfacecolor="white", markeredgecolor=SECOND,
            label=BASE, linestyle="none",
        )  # fmt: skip
    if row[after] is not None and row[after] != row[before]:
        (handles["after"],) = axis.plot(
            [100.0 * row[after]], [place], "o", markersize=size, color=MODEL, label=after_is, linestyle="none"
        )
    if row["noise_sd_f0"] is not None:
        (handles["noise"],) = axis.plot(
            [100.0 * row["noise_sd_f0"]], [place], "|", color="black", markersize=7, label="noise", linestyle="none"
        )
    return handles
