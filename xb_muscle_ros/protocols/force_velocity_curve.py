"""What force clamps and ramps of constant velocity have in common: Hill's hyperbola, its numbers and its figure."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.protocols.base import Cell, Column, Curve, Found, Number, Run
from xb_muscle_ros.protocols.figures import at_level, legend, legend_of_pca, lettered, looks, shaded, shades
from xb_muscle_ros.scores.estimate import Missing, notes_of
from xb_muscle_ros.scores.force_velocity import HillCurve, fit_hill, hill_velocity
from xb_muscle_ros.trials.trial import Array

# Columns of both tables, at their begin and at their end.
OF_TRIAL: Mapping[str, Column] = {
    "trial": Column("trial"),
    "pca": Column("pCa", form="g"),
    "isometric_f0": Column("isometric force", "F0", ".4f"),
}
POWER: Mapping[str, Column] = {"power_f0_l0_per_s": Column("power", "F0·L0/s", ".4f")}
SIZE_MM = (190.0, 70.0)
NUMBERS: Mapping[str, Column] = {
    "vmax_l0_per_s": Column("vmax", "L0/s", ".3f"),
    "a_over_f0": Column("a/F0", "", ".3f"),
    "b_l0_per_s": Column("b", "L0/s", ".3f"),
    "power_f0_l0_per_s": Column("largest power", "F0·L0/s", ".4f"),
    "load_at_power": Column("at a load of", "isometric force", ".3f"),
    "rmsd": Column("RMSD of the points", "", ".3g"),
}


def found_of(
    fibre: str,
    of: str,
    runs: Sequence[Run],
    rows: Sequence[Mapping[str, Cell]],
    told: Sequence[tuple[str, str]],
    load_is_given: bool,
) -> Found:
    """A table with Hill's hyperbola through its rows of most calcium.

    Args:
        rows: with ``pca``, ``isometric_f0``, ``load`` and ``shortening_l0_per_s``, one for each run.
        told: trial and why it lacks something.
        load_is_given: see `fit_hill`.
    """
    found = Found(fibre, of, tuple(rows), runs=tuple(runs))
    pca = found.column("pca")
    pcas = np.unique(np.round(pca[np.isfinite(pca)], 6))
    notes = notes_of(told)
    if pcas.size > 1:
        notes.append(f"Hill's hyperbola is that of pCa {pcas[0]:g}, the most calcium; give one --pca for another")
    most = np.isclose(pca, pcas[0]) if pcas.size else np.full(len(rows), True)
    isometric = found.column("isometric_f0")[most]
    level = float(np.nanmedian(isometric)) if np.any(np.isfinite(isometric)) else np.nan
    load, speed = found.column("load")[most], found.column("shortening_l0_per_s")[most]
    numbers, curves, more = _numbers_of(load, speed, level, load_is_given)
    return replace(found, numbers=numbers, curves=curves, notes=(*notes, *more))


def _numbers_of(
    load: Array, velocity_l0_per_s: Array, isometric_f0: float, load_is_given: bool
) -> tuple[dict[str, Number], dict[str, Curve], list[str]]:
    """Numbers of `NUMBERS`, the curves ``hill`` (load, velocity) and ``power`` (load, F0·L0/s), and notes.

    Args:
        load: force over the isometric force, shape (n,).
        velocity_l0_per_s: of shortening, shape (n,), L0/s.
        isometric_f0: force, F0.
        load_is_given: see `fit_hill`.
    """
    found = fit_hill(load, velocity_l0_per_s, load_is_given)
    if isinstance(found, Missing):
        return {key: Number(None, why=found.why) for key in NUMBERS}, {}, [f"Hill's hyperbola: {found.why}"]
    x = np.linspace(0.0, 1.0, 200)
    numbers = {
        "vmax_l0_per_s": _number(found.vmax_l0_per_s, found.se[2], found),
        "a_over_f0": _number(found.a, found.se[0], found),
        "b_l0_per_s": _number(found.b_l0_per_s, found.se[1], found),
        "power_f0_l0_per_s": Number(found.power_l0_per_s * isometric_f0),
        "load_at_power": Number(found.load_at_power),
        "rmsd": Number(found.rmsd),
    }
    speed = hill_velocity(x, found.a, found.vmax_l0_per_s)
    told = [
        f"{NUMBERS[key].text}: the 95 % interval goes down to 0 or below; these points do not tell it"
        for key in ("vmax_l0_per_s", "a_over_f0")
        if (low := numbers[key].low) is not None and low <= 0.0
    ]
    return numbers, {"hill": Curve(x, speed), "power": Curve(x, x * speed * isometric_f0)}, told


def draw(figure: Any, found: Sequence[Found], traces: str) -> None:
    """Records against time, velocity against load, and power against load.

    Args:
        found: with columns ``load``, ``shortening_l0_per_s`` and ``power_f0_l0_per_s``.
        traces: what is drawn against time, ``length`` or ``force``.
    """
    record, velocity, power = figure.subplots(1, 3)
    levels = shades(found)
    for look, each in looks(found):
        load = each.column("load")
        for level in levels:
            of_level, mine = shaded(look, level), at_level(each, level)
            for run in itertools.compress(each.runs, mine.tolist()):
                start_s = next((p.start_s for p in run.trial.facts.phases if p.name != "isometric"), 0.0)
                shown = 100.0 * run.length_l0 if traces == "length" else run.force_f0
                record.plot(run.time_s - start_s, shown, **of_level.trace)
            if np.any(mine):
                velocity.plot(load[mine], each.column("shortening_l0_per_s")[mine], **of_level.points)
                power.plot(load[mine], each.column("power_f0_l0_per_s")[mine], **of_level.points)
        if "hill" in each.curves:
            curve, of_most = each.curves["hill"], shaded(look, levels[0]).curve
            velocity.plot(curve.x, curve.y, **of_most)
            power.plot(*each.curves["power"], **of_most)
    record.set(
        xlabel=f"time from the begin of the {'clamp' if traces == 'length' else 'ramp'} (s)",
        ylabel="length change (% L$_0$)" if traces == "length" else "force (F$_0$)",
    )
    velocity.set(xlabel="force over isometric force", ylabel="velocity of shortening (L$_0$/s)")
    power.set(xlabel="force over isometric force", ylabel="power (F$_0$·L$_0$/s)")
    for axis in (velocity, power):
        axis.axhline(0.0, color="black", linewidth=0.6)
        axis.set_xlim(left=0.0)
    legend(velocity)
    legend_of_pca(record, levels)
    lettered([record, velocity, power])


def _number(value: float, se: float | None, found: HillCurve) -> Number:
    if se is None:
        return Number(value, why="too few points for a standard error")
    return Number(value, se, value - found.interval * se, value + found.interval * se)
