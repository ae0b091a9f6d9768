"""Relative SRS in the manner of the paper's figure 6: along activation, amplitude and recovery, and its RMSD."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.figures.look import MEASURED, look, shade
from xb_muscle_ros.evaluate.figures.profile import Profile
from xb_muscle_ros.evaluate.sections import SrsSection
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting.style import figure, save
from xb_muscle_ros.scores.conditions import (
    CLASSES,
    COMMON_AMPLITUDE_L0,
    COMMON_CLASS,
    COMMON_RECOVERY_S,
    LARGE_ABOVE_L0,
    LARGE_BELOW_S,
    RECOVERIES_S,
    SETS,
    activation_class,
)
from xb_muscle_ros.trials.trial import Array

_TOP = 1.75
_ALONG = ("activation", "amplitude", "recovery")
# Where a reading's bar stands beside a model's place.
_SIDES = {"text": -0.2, "released": 0.2}


NOTHING_TO_DRAW = (
    f"relative_srs.png is not drawn: no trial with {100 * COMMON_AMPLITUDE_L0:g} % L0 or {COMMON_RECOVERY_S:g} s has a "
    "relative SRS, and no condition is one of the paper's"
)


def drawable(data: SrsTable, tables: Mapping[str, SrsTable], section: SrsSection) -> bool:
    """Whether there is anything to draw; see `draw_srs`."""
    profiles = (Profile(table, along) for table in (data, *tables.values()) for along in _ALONG)
    scores = (of.under[reading].rmsd[which] for of in section.models.values() for reading in _SIDES for which in SETS)
    return any(profile.means()[0].size for profile in profiles) or any(score is not None for score in scores)


def draw_srs(path: Path, data: SrsTable, tables: Mapping[str, SrsTable], section: SrsSection) -> bool:
    """Draw profiles of relative SRS (A to C) and its RMSD by model (D to F); PNG, and PDF beside it.

    Dots are measured fibres with the standard errors of their relative SRS, where known; larger symbols their means
    with the s.d. over fibres.

    Args:
        data: measured SRS.
        tables: simulated SRS by model.
        section: ``srs`` of ``evaluate.json``.

    Returns:
        whether anything was drawn: an empty figure is not written.
    """
    if not drawable(data, tables, section):
        return False
    with figure(180.0, 125.0) as made:
        axes = made.subplots(2, 3, sharey="row")
        for axis, along in zip(axes[0], _ALONG, strict=True):
            _profile(axis, along, data, tables)
        for axis, which in zip(axes[1], SETS, strict=True):
            _bars(axis, which, section)
        axes[0][0].set_ylabel("Relative SRS")
        axes[1][0].set_ylabel("RMSD of relative SRS")
        for letter, axis in zip("ABCDEF", axes.flat, strict=True):
            axis.set_title(f"{letter}  {axis.get_title(loc='left')}", loc="left", fontweight="bold")
        handles, labels = axes[0][0].get_legend_handles_labels()
        order = sorted(range(len(labels)), key=lambda k: not labels[k].startswith("measured"))
        made.legend(
            [handles[k] for k in order], [labels[k] for k in order], loc="outside upper center", ncols=4, frameon=False
        )
        # Room for the words above the bars.
        axes[1][0].set_ylim(0.0, 1.3 * axes[1][0].get_ylim()[1])
        axes[1][0].text(0.98, 0.97, _readings_text(section), transform=axes[1][0].transAxes, ha="right", va="top",
            fontsize=6.5,
        )  # fmt: skip
        save(made, path)
    return True


def _readings_text(section: SrsSection) -> str:
    """What open and filled bars are, as far as there are any."""
    words = {"text": "open: reading 'text'", "released": "filled: reading 'released'"}
    shown = [
        words[reading]
        for reading in _SIDES
        if any(of.under[reading].rmsd[which] is not None for of in section.models.values() for which in SETS)
    ]
    return "\n".join(shown)


def _profile(axis: Any, along: str, data: SrsTable, tables: Mapping[str, SrsTable]) -> None:
    axis.axhline(1.0, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    measured = Profile(data, along)
    shown = np.where(np.abs(measured.y) < 10.0, measured.y, np.nan)
    axis.errorbar(
        measured.x.ravel(), shown.ravel(), np.where(np.isfinite(measured.se), measured.se, 0.0).ravel(), fmt=".",
        color="black", markersize=1.8, linewidth=0.5, zorder=2,
    )  # fmt: skip
    x, y, sd = measured.means()
    every = [x]
    large = _large(along, x)
    for filled in (True, False):
        some = large == filled
        axis.errorbar(
            x[some], y[some], sd[some], fmt="o", color=MEASURED, markersize=5.5, capsize=1.5, linewidth=1.0,
            markerfacecolor=MEASURED if filled else "white", zorder=4,
            label=f"measured, {'large' if filled else 'small'} reduction",
        )  # fmt: skip
    for name, table in tables.items():
        way = look(name)
        x, y, _ = Profile(table, along).means()
        every.append(x)
        order = np.argsort(x)
        axis.plot(
            x[order], y[order], color=way.colour, linestyle=way.line, linewidth=1.2, marker=way.marker, markersize=3.2,
            markerfacecolor="white" if way.hollow else way.colour, label=title_of(name), zorder=3,
        )  # fmt: skip
    axis.set_ylim(0.0, _TOP)
    tested = np.concatenate(every)
    text = {
        "activation": ("Isometric force (F$_0$)", f"{100 * COMMON_AMPLITUDE_L0:g} % L$_0$, {COMMON_RECOVERY_S:g} s"),
        "amplitude": ("Amplitude (% L$_0$)", f"{COMMON_CLASS} activation, {COMMON_RECOVERY_S:g} s"),
        "recovery": ("Recovery time (s)", f"{COMMON_CLASS} activation, {100 * COMMON_AMPLITUDE_L0:g} % L$_0$"),
    }[along]
    axis.set_xlabel(text[0])
    axis.text(0.98, 0.97, text[1], transform=axis.transAxes, ha="right", va="top", fontsize=6.5)
    axis.set_title(along, loc="left")
    if not tested.size:
        axis.text(0.5, 0.5, "not tested", transform=axis.transAxes, ha="center", va="center")
    elif along == "recovery":
        axis.set_xscale("log")
        # A single time would stand in the middle of one decade.
        axis.set_xlim(0.5 * min(RECOVERIES_S[0], float(np.min(tested))), 2.0 * max(1.0, float(np.max(tested))))
    else:
        axis.set_xlim(0.0, 1.08 * float(np.max(tested)))


def _large(along: str, x: Array) -> Any:
    """Which points of a profile the paper's text calls large reductions."""
    if along == "amplitude":
        return x > 100.0 * LARGE_ABOVE_L0
    if along == "recovery":
        return x < LARGE_BELOW_S
    return np.isin(activation_class(x), [CLASSES.index("low"), CLASSES.index("intermediate")])


def _bars(axis: Any, which: str, section: SrsSection) -> None:
    models = list(section.models)
    for k, name in enumerate(models):
        for reading, side in _SIDES.items():
            value = section.models[name].under[reading].rmsd[which]
            if value is not None:
                way = look(name)
                fill = shade(way.colour, 0.4) if way.hollow else way.colour
                axis.bar(
                    k + side, value, 0.36, color=fill if reading == "released" else "white", edgecolor=way.colour,
                    linewidth=1.0, hatch="////" if way.hollow else None,
                )  # fmt: skip
    axis.set_xticks(range(len(models)), [title_of(name) for name in models], rotation=35, ha="right")
    axis.set_xlim(-0.6, len(models) - 0.4)
    if all(of.under[reading].rmsd[which] is None for of in section.models.values() for reading in _SIDES):
        axis.text(0.5, 0.5, "not tested", transform=axis.transAxes, ha="center", va="center")
    axis.set_title(f"{which} reductions" if which != "all" else "all conditions", loc="left")
    axis.set_ylim(bottom=0.0)
