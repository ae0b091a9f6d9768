"""Are the values of a trial those of a muscle? Each fault is one line that names the bag, the value and the remedy."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.stamps import GAP_STEPS, largest_gap
from xb_muscle_ros.trials.told_facts import check_told_facts
from xb_muscle_ros.trials.trial import Trial

# With fewer nothing moves, and nothing can be compared.
LEAST_SAMPLES = 3
# Beyond these no fibre was measured; a record that goes there is in another unit. A whole muscle whose tendon goes
# slack in a release gets to 0.24 L0 (rat gastrocnemius, step and ramp).
LENGTH_CHANGE_L0 = (-0.9, 1.0)
FORCE_F0 = (-2.0, 10.0)
CALCIUM_UM = 1e4
# Beyond these it is worth a line: short-range stiffness, overlap and passive tension are known within.
USUAL_LENGTH_L0 = (0.5, 1.5)
USUAL_PEAK_F0 = 3.0
LEAST_PEAK_F0 = 3e-3
# Fibres pull: a record that is lower for half of its time has its sign reversed, or its zero off.
LEAST_MEDIAN_F0 = -0.1
# At this free calcium a fibre is active, µM (pCa 6.3).
ACTIVE_UM = 0.5
# With less than this it is relaxed, µM (pCa 10), and pulls less than this over most of a trial, F0.
RELAXED_UM = 1e-4
_RELAXED_F0 = 0.1
_PCA_APART = 0.05
# Above this pCa a fibre is relaxed, whatever stands for its calcium.
_RELAXED_PCA = 8.0
# Shorter gaps than this are none, s.
_GAP_S = 0.01
# What length changes by across a gap that can be lived with, L0.
_ACROSS_L0 = 5e-3


def check_values(trial: Trial, where: str, f0_is_told: bool = True, pca_is_told: bool = True) -> tuple[str, ...]:
    """Refuse a trial whose values make no sense; say what is unusual.

    Args:
        trial: with all facts.
        where: the bag, for messages.
        f0_is_told: whether bag, fibre file or user tell F0; else 1 N is taken for it.
        pca_is_told: whether the bag tells pCa; else calcium alone does.

    Returns:
        Lines on lengths and forces that are far from L0 and F0, and on gaps.

    Raises:
        UserError: length, force or calcium are in another unit than their topic or fact has, pCa is contrary to
            calcium, amplitude or recovery to length, or samples are too few or missing while length changes.
    """
    _check_samples(trial, where)
    _check_calcium(trial, where)
    lines = (*_length(trial, where), *_force(trial, where, f0_is_told), *_median_force(trial, where, pca_is_told))
    lines += (*_gaps(trial, where), *_cover(trial, where))
    check_told_facts(trial, where)
    return lines


def _check_samples(trial: Trial, where: str) -> None:
    for what, samples in (("length", trial.time_s.size), ("measured force", trial.force_time_s.size)):
        if samples < LEAST_SAMPLES and (samples or what == "length"):
            raise UserError(
                f"bag {where}: there are {samples} samples of {what}; needed are {LEAST_SAMPLES}; leave the bag out"
            )


def _length(trial: Trial, where: str) -> tuple[str, ...]:
    change = trial.length_change_l0
    worst = float(change[np.argmax(np.abs(change))])
    reference = f"one L0 is {trial.facts.reference_length_m:g} m (reference_length_m); --reference-length gives another"
    if not LENGTH_CHANGE_L0[0] <= worst <= LENGTH_CHANGE_L0[1]:
        raise UserError(
            f"bag {where}: length differs from L0 by {worst:.3g} L0; allowed is {LENGTH_CHANGE_L0[0]:g} to "
            f"{LENGTH_CHANGE_L0[1]:g}: lengths are in m, {reference}"
        )
    if USUAL_LENGTH_L0[0] <= 1.0 + worst <= USUAL_LENGTH_L0[1]:
        return ()
    return (f"bag {where}: length goes to {1.0 + worst:.3g} L0, far from L0: {reference}",)


def _force(trial: Trial, where: str, f0_is_told: bool) -> tuple[str, ...]:
    force = trial.measured_f0
    if force.size == 0:
        return ()
    worst = float(force[np.argmax(np.abs(force))])
    unit = f"forces are in N, one F0 is {trial.facts.f0_n:g} N (f0_n); --f0 gives another"
    if not FORCE_F0[0] <= worst <= FORCE_F0[1]:
        raise UserError(
            f"bag {where}: measured force goes to {worst:.3g} F0; allowed is {FORCE_F0[0]:g} to {FORCE_F0[1]:g}: {unit}"
        )
    active = float(np.max(trial.calcium_um)) >= ACTIVE_UM
    if abs(worst) <= USUAL_PEAK_F0 and not (active and abs(worst) < LEAST_PEAK_F0):
        return ()
    line = f"bag {where}: measured force goes to {worst:.3g} F0, far from F0: {unit}"
    if not f0_is_told:
        raise UserError(f"{line}, and nothing tells what F0 is")
    return (line,)


def _median_force(trial: Trial, where: str, pca_is_told: bool) -> tuple[str, ...]:
    """A line on a force of the wrong sign, or one that such calcium does not make."""
    middle = float(np.median(trial.measured_f0)) if trial.force_n.size else 0.0
    line = f"bag {where}: the median of measured force is {middle:.3g} F0"
    if middle < LEAST_MEDIAN_F0:
        return (f"{line}; usual is {LEAST_MEDIAN_F0:g} or more: is its sign reversed, or its zero off?",)
    calcium = float(np.max(trial.calcium_um))
    if middle > _RELAXED_F0 and calcium <= RELAXED_UM and not pca_is_told:
        return (f"{line}, though calcium is {calcium:.3g} µM, at which fibres are relaxed: calcium is in µM",)
    return ()


def _check_calcium(trial: Trial, where: str) -> None:
    calcium, pca = trial.calcium_um, trial.facts.pca
    if np.min(calcium) < 0.0 or np.max(calcium) > CALCIUM_UM:
        worst = float(calcium[np.argmax(np.abs(calcium))])
        raise UserError(f"bag {where}: calcium is {worst:.3g} µM; allowed is 0 to {CALCIUM_UM:g}: calcium is in µM")
    if pca is None:
        return
    if np.ptp(calcium) > 0.0:
        if np.min(np.abs(np.log10(np.maximum(calcium, 1e-12)) - 6.0 + pca)) > _PCA_APART:
            raise UserError(
                f"bag {where}: pCa is {pca:g}, but calcium changes from {np.min(calcium):.4g} to {np.max(calcium):.4g} "
                f"µM and never comes near {10.0 ** (6.0 - pca):.4g} µM; leave pCa out"
            )
        return
    if pca >= _RELAXED_PCA and calcium[0] <= 10.0 ** (6.0 - _RELAXED_PCA):
        return
    if calcium[0] <= 0.0 or abs(6.0 - np.log10(calcium[0]) - pca) > _PCA_APART:
        raise UserError(
            f"bag {where}: pCa is {pca:g} but calcium is {calcium[0]:.4g} µM, where {10.0 ** (6.0 - pca):.4g} µM "
            "belongs to it; calcium is in µM"
        )


def _gaps(trial: Trial, where: str) -> tuple[str, ...]:
    lines = []
    for what, time_s in (("length", trial.time_s), ("measured force", trial.force_time_s)):
        gap = largest_gap(time_s, _GAP_S)
        if gap is None:
            continue
        start_s, end_s, usual_s, _ = gap
        line = (
            f"bag {where}: {what} has no sample for {end_s - start_s:.3g} s after t = {start_s:.6g} s, where samples "
            f"are {usual_s:.3g} s apart"
        )
        before, after = np.interp([start_s, end_s], trial.time_s, trial.length_change_l0)
        if what == "length" and abs(after - before) > _ACROSS_L0:
            raise UserError(
                f"{line}, and changes by {after - before:.3g} L0 within; record it again or cut the trial there"
            )
        lines.append(f"{line}; {'a straight line is taken' if what == 'length' else 'nothing is compared there'}")
    return tuple(lines)


def _cover(trial: Trial, where: str) -> tuple[str, ...]:
    """A line on lengths before the first force, or after the last: nothing is compared there."""
    force_s, time_s = trial.force_time_s, trial.time_s
    if force_s.size < 2:
        return ()
    allowed_s = max(GAP_STEPS * float(np.median(np.diff(force_s))), _GAP_S)
    if max(force_s[0] - time_s[0], time_s[-1] - force_s[-1]) <= allowed_s:
        return ()
    return (
        f"bag {where}: measured force covers {force_s[0]:.6g} to {force_s[-1]:.6g} s, lengths {time_s[0]:.6g} to "
        f"{time_s[-1]:.6g} s; nothing is compared elsewhere",
    )
