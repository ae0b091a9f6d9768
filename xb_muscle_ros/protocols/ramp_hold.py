"""Ramp and hold: stiffness at the onset, force at the end of the ramp, stress relaxation and what remains."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import Cell, Column, Found, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import at_level, legend, legend_of_pca, lettered, looks, shaded, shades
from xb_muscle_ros.protocols.inputs import facts_of, pca_option, planned_between, rate_option
from xb_muscle_ros.scores.estimate import Estimate, notes_of
from xb_muscle_ros.scores.local import crossing
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.scores.stiffness import stiffness_of_phase
from xb_muscle_ros.trials.protocol import ALLOWED, SPEED_L0_PER_S, Allowed
from xb_muscle_ros.trials.trial import Phase

# Force at the end of the ramp and of the hold is a mean over this, s; of a shorter part the last tenth.
_MEAN_S, _SHARE = 0.002, 0.1
# A hold that loses less of the ramp's change than this has no half time.
_LOST = 0.05
# ... nor one that loses less than so many of its standard errors. Parabolas that read half times are at most so wide.
_UNSURE, _WIDE = 3.0, 0.5
_NO_HALF = "force does not come to half of what the hold loses"
# A change of force below this has no share to lose, F0.
_LEAST_F0 = 1e-4
_MOVING = ("stretch", "shortening", "release", "test_stretch")


class RampAndHold(Protocol):
    """One stretch or shortening at each pCa, amplitude and speed."""

    name = "ramp-hold"
    title = "stretch or shortening at constant speed, then hold: stiffness, peak force, stress relaxation"
    options = (
        pca_option(4.5, 6.1, 9.0),
        Option("amplitude", (0.0383,), Allowed(-0.5, 0.5, "L0"), "change of length, L0; negative shortens"),
        Option("speed", (SPEED_L0_PER_S,), ALLOWED["speed_l0_per_s"], "of the ramp, L0/s"),
        Option("hold", (2.0,), ALLOWED["hold_s"], "time after the ramp, s", many=False),
        Option("lead", (0.1,), ALLOWED["lead_s"], "isometric time before, s", many=False),
        rate_option(1000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "amplitude_l0": Column("amplitude", "% L0", ".3g", 100.0),
        "speed_l0_per_s": Column("speed", "L0/s", ".3g"),
        "isometric_f0": Column("isometric force", "F0", ".3f"),
        "srs_f0_per_l0": Column("SRS", "F0/L0", ".2f"),
        "end_f0": Column("force at the end of the ramp", "F0", ".3f"),
        "held_f0": Column("force at the end of the hold", "F0", ".3f"),
        "relaxed": Column("share of the change that is lost in the hold", "", ".3f"),
        "half_s": Column("time to half of that", "ms", ".3g", 1e3),
    }
    source = "e.g. Pinniger, Ranatunga and Offer 2006"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each combination.

        Raises:
            UserError: an amplitude is zero.
        """
        hold, lead, rate = (settings[k][0] for k in ("hold", "lead", "rate"))
        planned = []
        for pca, amplitude, speed in itertools.product(*(settings[k] for k in ("pca", "amplitude", "speed"))):
            if amplitude == 0.0:
                raise UserError("--amplitude is 0 L0; a ramp needs a change of length")
            stretch = amplitude > 0.0
            name = f"ramp_{'plus' if stretch else 'minus'}{abs(amplitude) * 1e4:g}_v{speed:g}_pca{10.0 * pca:g}"
            told = {"pca": pca, "amplitude_l0": amplitude, "speed_l0_per_s": speed}
            steps = [
                ("isometric", lead, 0.0),
                ("stretch" if stretch else "shortening", abs(amplitude) / speed, amplitude),
                ("hold" if stretch else "recovery", hold, 0.0),
            ]
            planned.append(planned_between(facts_of(self.name, fibre, name, told), steps, pca, rate))
        return planned

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Change of force by each ramp, and how much of it remains after the hold."""
        rows, told = [], []
        for run in runs:
            row, whys = _row(run)
            rows.append(row)
            told += [(run.trial.facts.trial, why) for why in whys]
        return Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(notes_of(told)))

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Length and force from the begin of the ramp on."""
        (length, ramp), (force, hold) = figure.subplots(2, 2, height_ratios=(1.0, 2.4), sharex="col")
        longest_s = 0.0
        levels = shades(found)
        for (look, each), level in itertools.product(looks(found), levels):
            for run in itertools.compress(each.runs, at_level(each, level).tolist()):
                phase = _ramp(run)
                if phase is None:
                    continue
                since = run.time_s - phase.start_s
                longest_s = max(longest_s, phase.end_s - phase.start_s)
                for above, below in ((length, force), (ramp, hold)):
                    above.plot(since, 100.0 * run.length_l0, color="black", linewidth=0.8)
                    below.plot(since, run.force_f0, **shaded(look, level).trace)
        if longest_s:
            force.set_xlim(-0.3 * longest_s, 1.5 * longest_s)
        for above, below in ((length, force), (ramp, hold)):
            above.set_ylabel("length change\n(% L$_0$)")
            below.set(xlabel="time from the begin of the ramp (s)", ylabel="force (F$_0$)")
        legend(hold)
        legend_of_pca(force, levels)
        lettered([length, ramp])


def _ramp(run: Run) -> Phase | None:
    """The one change of length of a trial; None where there is none, or more than one."""
    moving = [phase for phase in run.trial.facts.phases if phase.name in _MOVING]
    others = [phase for phase in run.trial.facts.phases if phase.name == "conditioning_stretch"]
    return moving[0] if len(moving) == 1 and not others else None


def _row(run: Run) -> tuple[Mapping[str, Cell], list[str]]:
    """A row, and why it lacks what it lacks."""
    facts = run.trial.facts
    before = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
    row: dict[str, Cell] = {"trial": facts.trial, "pca": facts.pca, "isometric_f0": before}
    whys = [f"isometric force: {before.why}"] if before.why else []
    phase = _ramp(run)
    if phase is None:
        return row, [*whys, "ramp: there is no single stretch or shortening"]
    begin, end = np.interp([phase.start_s, phase.end_s], run.trial.time_s, run.trial.length_change_l0)
    lasts_s = phase.end_s - phase.start_s
    # The samples cut a ramp's corners off; what the protocol was given is exact.
    amplitude, speed = run.setting("amplitude_l0"), run.setting("speed_l0_per_s")
    row["amplitude_l0"] = float(end - begin) if amplitude is None else amplitude
    row["speed_l0_per_s"] = float(abs(end - begin)) / lasts_s if speed is None else speed
    srs = stiffness_of_phase(run.time_s, run.length_l0, run.force_f0, phase, run.noise)
    at_end = _mean(run, phase.end_s - min(_MEAN_S, _SHARE * lasts_s), phase.end_s)
    last_s = float(run.time_s[-1])
    held = _mean(run, last_s - _SHARE * (last_s - phase.end_s), last_s)
    row |= {"srs_f0_per_l0": srs, "end_f0": at_end, "held_f0": held}
    whys += [f"SRS: {srs.why}"] if srs.value is None and srs.why else []
    if before.value is None or at_end.value is None or held.value is None or at_end.value == before.value:
        return row, whys
    change = at_end.value - before.value
    if abs(change) < max(_LEAST_F0, 3.0 * (at_end.se or 0.0)):
        return row, [*whys, f"share lost: the ramp changes force by {change:.2g} F0 alone"]
    row["relaxed"] = (at_end.value - held.value) / change
    row["half_s"] = _half(run, phase.end_s, at_end, held, abs(change))
    return row, whys


def _half(run: Run, from_s: float, at_end: Estimate, held: Estimate, change_f0: float) -> Estimate:
    """Time from the end of the ramp until half of what the hold loses is lost, s."""
    assert at_end.value is not None
    assert held.value is not None
    lost = at_end.value - held.value
    se = float(np.hypot(at_end.se or 0.0, held.se or 0.0))
    if abs(lost) <= max(_LOST * change_f0, _UNSURE * se):
        error = f" ± {se:.2g} (SE)" if se else ""
        return Estimate(None, why=f"the hold loses {abs(lost):.2g}{error} F0 alone, of a change of {change_f0:.2g} F0")
    # Of a force that rises in the hold its negative falls.
    sign, level = np.sign(lost), 0.5 * (at_end.value + held.value)
    if run.noise is None:
        below = np.flatnonzero((run.time_s >= from_s) & (sign * (run.force_f0 - level) <= 0.0))
        k = int(below[0]) if below.size else 0
        if k == 0:
            return Estimate(None, why=_NO_HALF)
        before, at = (float(each) for each in sign * (run.force_f0[k - 1 : k + 1] - level))
        share = before / (before - at) if before > 0.0 else 1.0
        crossed_s = float(run.time_s[k - 1] + share * (run.time_s[k] - run.time_s[k - 1]))
        return Estimate(max(crossed_s - from_s, 0.0))
    half = Estimate(sign * level, 0.5 * se)
    found = crossing(run.time_s, sign * run.force_f0, half, from_s, _WIDE, run.noise)
    return Estimate(None, why=_NO_HALF) if found.value is None else Estimate(found.value - from_s, found.se)


def _mean(run: Run, from_s: float, to_s: float) -> Estimate:
    """Mean force in a window, or force at the first sample after one that has none."""
    inside = (run.time_s >= from_s - 5e-10) & (run.time_s <= to_s + 5e-10)
    if not np.any(inside):
        inside = np.arange(run.time_s.size) == min(int(np.searchsorted(run.time_s, to_s - 5e-10)), run.time_s.size - 1)
    se = None if run.noise is None else run.noise.of_mean(run.time_s[inside])
    return Estimate(float(np.mean(run.force_f0[inside])), se)
