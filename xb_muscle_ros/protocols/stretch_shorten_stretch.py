"""Stretch, shortening and stretch (van der Zee et al. 2026): short-range stiffness, and what history takes of it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.protocols.base import Cell, Column, Found, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import legend, lettered, looks
from xb_muscle_ros.protocols.inputs import pca_option, rate_option
from xb_muscle_ros.scores.readout import ISOMETRIC, SRS_CONDITIONING, SRS_TEST, read_off, references, relative_srs
from xb_muscle_ros.trials.protocol import ALLOWED, StretchShortenStretch

_MOST_TICKS = 10


class StretchShortenStretches(Protocol):
    """Every combination of pCa, amplitude and recovery time."""

    name = "stretch-shorten-stretch"
    title = "stretch, shortening back, recovery, test stretch: short-range stiffness and its history"
    options = (
        pca_option(6.1),
        Option("amplitude", (0.0383,), ALLOWED["amplitude_l0"], "conditioning stretch, L0 (0: none)"),
        Option("recovery", (0.001,), ALLOWED["recovery_s"], "time between shortening and test stretch, s"),
        rate_option(1000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "amplitude_l0": Column("amplitude", "% L0", ".3g", 100.0),
        "recovery_s": Column("recovery", "s", "g"),
        ISOMETRIC: Column("isometric force", "F0", ".3f"),
        SRS_CONDITIONING: Column("SRS, conditioning", "F0/L0", ".2f"),
        SRS_TEST: Column("SRS, test", "F0/L0", ".2f"),
        "srs_relative": Column("relative SRS", "", ".3f"),
    }
    source = "van der Zee et al. 2026; Horslen et al. 2023"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each combination."""
        rate = settings["rate"][0]
        planned = []
        for pca, amplitude, recovery in itertools.product(*(settings[k] for k in ("pca", "amplitude", "recovery"))):
            protocol = StretchShortenStretch(amplitude, recovery)
            trial = protocol.trial(fibre, pca, rate)
            told = (("amplitude_l0", amplitude), ("recovery_s", recovery))
            trial = replace(trial, facts=replace(trial.facts, protocol=self.name, settings=told))
            planned.append(Planned(trial, *protocol.corners()))
        return planned

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """SRS of both stretches, and that of the test stretch beside the reference trial of its pCa."""
        facts = [run.trial.facts for run in runs]
        scores = [read_off(run.trial, run.time_s, run.force_f0, run.noise) for run in runs]
        beside = references([(each.fibre, each.pca, each.amplitude_l0, each.recovery_s) for each in facts])
        rows: list[Mapping[str, Cell]] = []
        for k, (each, found, reference) in enumerate(zip(facts, scores, beside, strict=True)):
            relative = None
            if reference is not None:
                relative = relative_srs(found[SRS_TEST], scores[reference][SRS_TEST], reference == k)
            conditions = {"pca": each.pca, "amplitude_l0": each.amplitude_l0, "recovery_s": each.recovery_s}
            rows.append({"trial": each.trial, **conditions, **found, "srs_relative": relative})
        notes = []
        if all(reference is None for reference in beside):
            notes.append("relative SRS needs a trial without conditioning stretch (amplitude 0); there is none")
        return Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(notes))

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force against time, and SRS of the test stretch against recovery time."""
        traces, points = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
        for look, each in looks(found):
            for run in each.runs:
                traces.plot(run.time_s, run.force_f0, **look.trace)
            points.plot(1e3 * each.column("recovery_s"), each.column(SRS_TEST), **look.points)
        traces.set(xlabel="time (s)", ylabel="force (F$_0$)")
        points.set(xlabel="recovery time (ms)", ylabel="SRS of the test stretch (F$_0$/L$_0$)")
        points.set_xscale("symlog", linthresh=1.0)
        times_ms = sorted(
            {float(each) for one in found for each in 1e3 * one.column("recovery_s") if np.isfinite(each)}
        )
        if 0 < len(times_ms) <= _MOST_TICKS:  # the times themselves: a decade may hold them all
            points.set_xticks(times_ms, [f"{each:g}" for each in times_ms])
            points.set_xticks([], minor=True)
        points.set_ylim(bottom=0.0)
        _name_pca(points, found[:1])
        legend(points)
        lettered([traces, points])


def _name_pca(axis: Any, found: Sequence[Found]) -> None:
    """Say at the longest recovery of each pCa which it is, where there are several."""
    for each in found:
        pca, time_ms, srs = each.column("pca"), 1e3 * each.column("recovery_s"), each.column(SRS_TEST)
        shown = np.isfinite(pca) & np.isfinite(time_ms) & np.isfinite(srs)
        levels = sorted(set(pca[shown].tolist()))
        for level in levels if len(levels) > 1 else ():
            last = max(np.flatnonzero(shown & (pca == level)), key=lambda k: float(time_ms[k]))
            axis.annotate(
                f"pCa {level:g}", (time_ms[last], srs[last]), xytext=(5, 0), textcoords="offset points",
                ha="left", va="center", fontsize="small",
            )  # fmt: skip
        if len(levels) > 1:
            axis.margins(x=0.3)
