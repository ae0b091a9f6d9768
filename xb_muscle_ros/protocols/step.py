"""Quick length steps: T1 and T2 curves (Huxley and Simmons 1971; Ford, Huxley and Simmons 1977)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import Cell, Column, Curve, Found, Number, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import legend, lettered, looks
from xb_muscle_ros.protocols.inputs import facts_of, pca_option, planned_between, rate_option
from xb_muscle_ros.scores.estimate import Estimate, Missing, notes_of, rounded
from xb_muscle_ros.scores.quick_recovery import first_tension, quick_recovery
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.trials.protocol import ALLOWED, Allowed
from xb_muscle_ros.trials.trial import Trial

# A recording's motor takes longer than the fastest step; what takes longer than this is a ramp.
_LONGEST_S = 0.005
# T1 is a straight line for steps as small as this (Ford, Huxley and Simmons 1977: about ± 3 nm in a half-sarcomere of
# 1.1 µm); beyond it the fibre is stiffer when stretched and slack when released.
_SMALL_L0 = 0.003
# What T1 is read so long after the step is told, s: a quick phase has begun.
_LATE_S = 1e-4
# A stiffness is above zero by so many standard errors.
_SURE = 3.0
# Length is looked at for so long before and after a step, s; it is still after it within this share of the step.
_STILL_S, _SETTLED = 1e-3, 0.01
# Less of the change of force than this is left a sample after the step.
_GONE = 0.1


class QuickSteps(Protocol):
    """One step of length in each trial."""

    name = "step"
    title = "quick length steps: T1 and T2 curves, stiffness"
    options = (
        pca_option(4.5),
        Option(
            "size",
            (-0.01, -0.0075, -0.005, -0.0025, -0.001, 0.001, 0.0025, 0.005),
            Allowed(-0.1, 0.1, "L0"),
            "of a step, L0; negative releases",
        ),
        Option(
            "step-time", (0.0002,), Allowed(0.0, _LONGEST_S, "s", positive=True), "how long it takes, s", many=False
        ),
        Option("window", (0.05,), Allowed(0.001, 10.0, "s"), "recovery that is fitted for T2, s", many=False),
        Option("lead", (0.01,), ALLOWED["lead_s"], "isometric time before, s", many=False),
        rate_option(20000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "size_l0": Column("step", "% L0", ".3f", 100.0),
        "step_s": Column("step time", "ms", ".3g", 1e3),
        "isometric_f0": Column("isometric force", "F0", ".4f"),
        "t1_f0": Column("T1", "F0", ".4f"),
        "t2_f0": Column("T2", "F0", ".4f"),
        "quick_per_s": Column("rate of the quick phase", "1/s", ".0f"),
        "slow_per_s": Column("rate of the slow phase", "1/s", ".1f"),
    }
    numbers: Mapping[str, Column] = {
        "stiffness_f0_per_l0": Column("stiffness", "F0/L0", ".1f"),
        "y0_l0": Column("release to zero force by this stiffness", "% L0", ".3f", 100.0),
    }
    source = "Huxley and Simmons 1971; Ford, Huxley and Simmons 1977"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa and size of step.

        Raises:
            UserError: a size is zero.
        """
        step_s, window, lead, rate = (settings[k][0] for k in ("step-time", "window", "lead", "rate"))
        # The end of the step is a sample: T1 is force there.
        lead = float(np.ceil((lead + step_s) * rate - 1e-6)) / rate - step_s
        planned = []
        for pca, size in itertools.product(settings["pca"], settings["size"]):
            if size == 0.0:
                raise UserError("--size is 0 L0; a step needs a change of length")
            name = f"step_{'minus' if size < 0.0 else 'plus'}{abs(size) * 1e5:g}_pca{10.0 * pca:g}"
            told = {"pca": pca, "size_l0": size, "step_s": step_s, "window_s": window}
            moved = "release" if size < 0.0 else "stretch"
            after = "recovery" if size < 0.0 else "hold"
            steps = [("isometric", lead, 0.0), (moved, step_s, size), (after, window, 0.0)]
            planned.append(planned_between(facts_of(self.name, fibre, name, told), steps, pca, rate))
        return planned

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """T1 and T2 of each step, and the stiffness of the smallest."""
        rows: list[Mapping[str, Cell]] = []
        told = []
        for run in runs:
            row, whys = _row(run)
            rows.append(row)
            told += [(run.trial.facts.trial, why) for why in whys]
        found = Found(fibre, of, tuple(rows), runs=tuple(runs), notes=tuple(notes_of(told)))
        numbers, curves, more = _line(found)
        return Found(fibre, of, found.rows, numbers, curves, found.runs, (*found.notes, *more))

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force around the step, and T1 (filled) and T2 (open) against its size."""
        traces, curves = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
        for look, each in looks(found):
            for run in each.runs:
                step = _step(run)
                if step is not None:
                    traces.plot(1e3 * (run.time_s - step[0]), run.force_f0, **look.trace)
            size = 100.0 * each.column("size_l0")
            curves.errorbar(size, each.column("t1_f0"), each.errors("t1_f0"), **look.points, elinewidth=0.8)
            hollow = {**look.points, "markerfacecolor": "white", "label": "_"}
            curves.errorbar(size, each.column("t2_f0"), each.errors("t2_f0"), **hollow, elinewidth=0.8)
            if "t1" in each.curves:
                curves.plot(100.0 * each.curves["t1"].x, each.curves["t1"].y, **look.curve)
        traces.set(xlabel="time from the begin of the step (ms)", ylabel="force (F$_0$)")
        curves.set(
            xlabel="step (% L$_0$)", ylabel="T$_1$ filled, T$_2$ open (F$_0$)", ylim=(min(0.0, _low(found)), None)
        )
        legend(curves)
        lettered([traces, curves])


def _low(found: Sequence[Found]) -> float:
    lowest = [np.nanmin(each.column("t1_f0")) for each in found if np.any(np.isfinite(each.column("t1_f0")))]
    return float(min(lowest, default=0.0))


def _step(run: Run) -> tuple[float, float] | None:
    """Begin and end (s) of the one step of a trial; None where there is none, or more than one."""
    quick = [
        phase
        for phase in run.trial.facts.phases
        if phase.name not in ("isometric", "recovery", "hold") and phase.end_s - phase.start_s <= _LONGEST_S + 5e-10
    ]
    return (quick[0].start_s, quick[0].end_s) if len(quick) == 1 else None


def _row(run: Run) -> tuple[Mapping[str, Cell], list[str]]:
    """A row, and why it lacks T1 or T2, or may be off."""
    facts = run.trial.facts
    before = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
    row: dict[str, Cell] = {"trial": facts.trial, "pca": facts.pca, "isometric_f0": before}
    step = _step(run)
    if step is None:
        return row, [f"step: there is no single step that takes {1e3 * _LONGEST_S:g} ms or less"]
    start_s, end_s = step
    told_l0 = run.setting("size_l0")
    found_l0 = _size(run.trial, start_s, end_s) if told_l0 is None else Estimate(told_l0)
    size = found_l0.value or 0.0
    t1, sample, lag_s = first_tension(run.time_s, run.force_f0, step, size, run.noise, run.simulated is None)
    row |= {
        "size_l0": size if told_l0 is not None or run.simulated is not None else found_l0,
        "step_s": end_s - start_s,
        "t1_f0": t1,
    }
    told = _of_t1(run, before, t1, sample, end_s)
    if lag_s:
        end_s = float(run.time_s[sample])
        if t1.value is not None:
            when = f"{1e3 * abs(lag_s):.2g} ms {'after' if lag_s > 0.0 else 'before'}"
            told.append(
                f"T1: force comes to its extreme {when} the end of the length step, so T1 and T2 are read from there"
            )
    window_s = run.setting("window_s") or min(0.05, float(run.time_s[-1]) - end_s)
    found = quick_recovery(run.time_s, run.force_f0, end_s, window_s, size, run.noise)
    if isinstance(found, Missing):
        return row, [*told, f"T2: {found.why}"]
    return row | {
        "t2_f0": found.t2_f0,
        "quick_per_s": found.quick_per_s,
        "slow_per_s": found.slow_per_s,
    }, told


def _of_t1(run: Run, before: Estimate, t1: Estimate, sample: int, end_s: float) -> list[str]:
    """Why there is no T1, or why it may be off."""
    if t1.value is None:
        return [f"T1: {t1.why}"]
    told = []
    first = min(int(np.searchsorted(run.time_s, end_s - 5e-10)), run.time_s.size - 1)
    late_s = float(run.time_s[first]) - end_s
    if late_s > _LATE_S:
        told.append(f"T1: it is that of the first sample, {1e3 * late_s:.2g} ms after the step")
    if before.value is not None and sample + 1 < run.time_s.size:
        kept, change = float(run.force_f0[sample + 1]) - before.value, abs(t1.value - before.value)
        if abs(kept) < _GONE * change and change > 5.0 * (t1.se or 0.0):
            told.append("T1: force is gone with the movement; that is viscosity, not stiffness")
    return told


def _size(trial: Trial, start_s: float, end_s: float) -> Estimate:
    """How far length is from where it was, at the first sample after a step, L0.

    Where length is still before and after, but for noise, the mean of a millisecond counts on either side.
    """
    before = max(int(np.searchsorted(trial.time_s, start_s + 5e-10, side="right")) - 1, 0)
    after = min(int(np.searchsorted(trial.time_s, end_s - 5e-10)), trial.time_s.size - 1)
    begin = int(np.searchsorted(trial.time_s, trial.time_s[before] - _STILL_S - 5e-10))
    end = int(np.searchsorted(trial.time_s, trial.time_s[after] + _STILL_S + 5e-10, side="right"))
    length = trial.length_change_l0
    one = float(length[after] - length[before])
    still, later = length[begin : before + 1], length[after:end]
    if np.ptp(later) > max(_SETTLED * abs(one), 2.0 * float(np.ptp(still))):
        return Estimate(one)
    se = float(np.sqrt(np.var(later) / later.size + np.var(still) / still.size))
    return Estimate(float(np.mean(later) - np.mean(still)), rounded(se))


def _line(found: Found) -> tuple[dict[str, Number], dict[str, Curve], list[str]]:
    """The straight line through T1 of small steps of the highest calcium, and the force before them."""
    size, t1, pca = found.column("size_l0"), found.column("t1_f0"), found.column("pca")
    highest = np.isclose(pca, np.nanmin(pca)) if np.any(np.isfinite(pca)) else np.full(size.shape, True)
    small = highest & np.isfinite(t1) & (np.abs(size) <= _SMALL_L0 + 1e-9)
    if np.count_nonzero(small) < 2:
        return {}, {}, [f"stiffness needs two steps of {100.0 * _SMALL_L0:g} % L0 or less at one pCa"]
    before, of_before = found.column("isometric_f0")[small], found.errors("isometric_f0")[small]
    known = np.isfinite(before)
    x = np.append(size[small], 0.0)[: small.sum() + bool(known.any())]
    y, errors = t1[small], found.errors("t1_f0")[small]
    if known.any():
        y = np.append(y, np.mean(before[known]))
        errors = np.append(errors, np.sqrt(np.sum(of_before[known] ** 2)) / np.count_nonzero(known))
    weights = np.linalg.pinv(np.column_stack([x, np.ones(x.size)]))
    slope, at_zero = (float(value) for value in weights @ y)
    # An error of a step's size counts by what the line makes of it.
    of_size = np.zeros(errors.size)
    of_size[: size[small].size] = np.nan_to_num(found.errors("size_l0")[small])
    errors = np.hypot(errors, slope * of_size)
    by_y0 = (weights[1] - at_zero / slope * weights[0]) / slope if slope else weights[1]
    of_slope, of_y0 = (
        rounded(float(np.sqrt(np.sum((by * errors) ** 2)))) if np.all(np.isfinite(errors)) else None
        for by in (weights[0], by_y0)
    )
    if not slope > _SURE * (of_slope or 0.0):
        known_to = "" if of_slope is None else f" ± {of_slope:.2g}"
        return {}, {}, [f"T1 of small steps does not rise with their size ({slope:.3g}{known_to} F0/L0)"]
    line = np.linspace(max(float(np.min(size[highest])), -at_zero / slope), float(np.max(x)), 50)
    numbers = {"stiffness_f0_per_l0": Number(slope, of_slope), "y0_l0": Number(at_zero / slope, of_y0)}
    return numbers, {"t1": Curve(line, at_zero + slope * line)}, []
