"""Are the values of a trial those of a muscle? Each fault is one line that names the bag, the value and the remedy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.trials.stamps import GAP_STEPS, largest_gap
from xb_muscle_ros.trials.stated import SHARE, before, least_pause_s, leaves_room_for_stretch
from xb_muscle_ros.trials.trial import Phase, Trial

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
# Amplitudes are fractions of L0: larger ones are those that the lengths show. Facts are compared with what phases have
# where either is large enough to be seen.
_AMPLITUDE_L0 = 0.5
_SHORTEST_COMPARED_S, _SMALLEST_COMPARED_L0 = 0.02, 0.01


class Belied(NamedTuple):
    """A fact by its name that the lengths belie: in what, and what to do about it."""

    name: str
    what: str
    remedy: str


def check_values(trial: Trial, where: str, f0_is_known: bool = True, pca_is_known: bool = True) -> tuple[str, ...]:
    """Refuse the trial of a bag whose values make no sense; say what is unusual.

    Args:
        trial: with all facts.
        where: the bag, for messages.
        f0_is_known: whether bag, fibre file or user tell F0; else 1 N is taken for it.
        pca_is_known: whether the bag tells pCa; else calcium alone does.

    Returns:
        Lines on lengths and forces that are far from L0 and F0, and on gaps.

    Raises:
        UserError: see `unusual`.
    """
    with naming(f"bag {where}"):
        lines = unusual(trial, f0_is_known, pca_is_known)
    return tuple(f"bag {where}: {line}" for line in lines)


def unusual(trial: Trial, f0_is_known: bool = True, pca_is_known: bool = True) -> list[str]:
    """What is unusual about a trial that makes sense; the arguments are those of `check_values`.

    Raises:
        UserError: length, force or calcium are in another unit than their topic or fact has, pCa is contrary to
            calcium, amplitude or recovery to length, or samples are too few or missing while length changes.
    """
    _check_samples(trial)
    _check_calcium(trial)
    lines = [*_length(trial), *_force(trial, f0_is_known), *_median_force(trial, pca_is_known)]
    lines += [*_gaps(trial), *_cover(trial), *unrecorded(trial)]
    for fact in belied(trial):
        raise UserError(f"{fact.what}; {fact.remedy}")
    return lines


def _check_samples(trial: Trial) -> None:
    for what, samples in (("length", trial.time_s.size), ("measured force", trial.force_time_s.size)):
        if samples < LEAST_SAMPLES and (samples or what == "length"):
            raise UserError(f"there are {samples} samples of {what}; needed are {LEAST_SAMPLES}; leave it out")


def _length(trial: Trial) -> Iterator[str]:
    change = trial.length_change_l0
    worst = float(change[np.argmax(np.abs(change))])
    reference = f"one L0 is {trial.facts.reference_length_m:g} m (reference_length_m); --reference-length gives another"
    low, high = LENGTH_CHANGE_L0
    if not low <= worst <= high:
        allowed = f"allowed is {low:g} to {high:g}: lengths are in m, {reference}"
        raise UserError(f"length differs from L0 by {worst:.3g} L0; {allowed}")
    if not USUAL_LENGTH_L0[0] <= 1.0 + worst <= USUAL_LENGTH_L0[1]:
        yield f"length goes to {1.0 + worst:.3g} L0, far from L0: {reference}"


def _force(trial: Trial, f0_is_known: bool) -> Iterator[str]:
    force, (low, high) = trial.measured_f0, FORCE_F0
    worst = float(force[np.argmax(np.abs(force))]) if force.size else 0.0
    unit = f"forces are in N, one F0 is {trial.facts.f0_n:g} N (f0_n); --f0 gives another"
    if not low <= worst <= high:
        raise UserError(f"measured force goes to {worst:.3g} F0; allowed is {low:g} to {high:g}: {unit}")
    least = LEAST_PEAK_F0 if float(np.max(trial.calcium_um)) >= ACTIVE_UM else 0.0
    if force.size and not least <= abs(worst) <= USUAL_PEAK_F0:
        line = f"measured force goes to {worst:.3g} F0, far from F0: {unit}"
        if not f0_is_known:
            raise UserError(f"{line}, and nothing tells what F0 is")
        yield line


def _median_force(trial: Trial, pca_is_known: bool) -> Iterator[str]:
    """A line on a force of the wrong sign, or one that such calcium does not make."""
    middle = float(np.median(trial.measured_f0)) if trial.force_n.size else 0.0
    calcium = float(np.max(trial.calcium_um))
    line = f"the median of measured force is {middle:.3g} F0"
    if middle < LEAST_MEDIAN_F0:
        yield f"{line}; usual is {LEAST_MEDIAN_F0:g} or more: is its sign reversed, or its zero off?"
    elif middle > _RELAXED_F0 and calcium <= RELAXED_UM and not pca_is_known:
        yield f"{line}, though calcium is {calcium:.3g} µM, at which fibres are relaxed: calcium is in µM"


def _check_calcium(trial: Trial) -> None:
    calcium, pca = trial.calcium_um, trial.facts.pca
    if np.min(calcium) < 0.0 or np.max(calcium) > CALCIUM_UM:
        worst = float(calcium[np.argmax(np.abs(calcium))])
        raise UserError(f"calcium is {worst:.3g} µM; allowed is 0 to {CALCIUM_UM:g}: calcium is in µM")
    if pca is None or (np.ptp(calcium) == 0.0 and pca >= _RELAXED_PCA and calcium[0] <= 10.0 ** (6.0 - _RELAXED_PCA)):
        return
    apart = float(np.min(np.abs(np.log10(np.maximum(calcium, 1e-12)) - 6.0 + pca)))
    if apart > _PCA_APART and np.ptp(calcium) > 0.0:
        raise UserError(
            f"pCa is {pca:g}, but calcium changes from {np.min(calcium):.4g} to {np.max(calcium):.4g} µM and never "
            f"comes near {10.0 ** (6.0 - pca):.4g} µM; leave pCa out"
        )
    if apart > _PCA_APART:
        raise UserError(
            f"pCa is {pca:g} but calcium is {calcium[0]:.4g} µM, where {10.0 ** (6.0 - pca):.4g} µM belongs to it; "
            "calcium is in µM"
        )


def _gaps(trial: Trial) -> Iterator[str]:
    for what, time_s in (("length", trial.time_s), ("measured force", trial.force_time_s)):
        gap = largest_gap(time_s, _GAP_S)
        if gap is None:
            continue
        line = (
            f"{what} has no sample for {gap.end_s - gap.start_s:.3g} s after t = {gap.start_s:.6g} s, where samples "
            f"are {gap.usual_s:.3g} s apart"
        )
        before, after = np.interp([gap.start_s, gap.end_s], trial.time_s, trial.length_change_l0)
        if what == "length" and abs(after - before) > _ACROSS_L0:
            remedy = "record it again or cut the trial there"
            raise UserError(f"{line}, and changes by {after - before:.3g} L0 within; {remedy}")
        yield f"{line}; {'a straight line is taken' if what == 'length' else 'nothing is compared there'}"


def _cover(trial: Trial) -> Iterator[str]:
    """A line on lengths before the first force, or after the last: nothing is compared there."""
    force_s, time_s = trial.force_time_s, trial.time_s
    if force_s.size < 2:
        return
    allowed_s = max(GAP_STEPS * float(np.median(np.diff(force_s))), _GAP_S)
    if max(force_s[0] - time_s[0], time_s[-1] - force_s[-1]) > allowed_s:
        yield (
            f"measured force covers {force_s[0]:.6g} to {force_s[-1]:.6g} s, lengths {time_s[0]:.6g} to "
            f"{time_s[-1]:.6g} s; nothing is compared elsewhere"
        )


def belied(trial: Trial) -> Iterator[Belied]:
    """Stated amplitude and recovery that are in another unit, or of another trial than the lengths."""
    amplitude = trial.facts.amplitude_l0
    phases = _recorded(trial)
    stretch = phases.get("conditioning_stretch")
    shown = None if stretch is None else _amplitude(trial, stretch)
    if amplitude is not None and not 0.0 <= amplitude <= _AMPLITUDE_L0 and (shown is None or _apart(shown, amplitude)):
        allowed = f"allowed is 0 to {_AMPLITUDE_L0:g}: amplitudes are fractions of L0, not percent"
        yield Belied("amplitude_l0", f"amplitude_l0 is {amplitude:g}", allowed)
    elif amplitude is not None and stretch is not None and shown is not None:
        if max(amplitude, shown) >= _SMALLEST_COMPARED_L0:
            yield from _compared(shown, amplitude, "amplitude_l0", "L0", stretch)
    elif amplitude is not None:
        yield from _missing(trial, amplitude)
    yield from _recovery(trial, phases)


def unrecorded(trial: Trial) -> Iterator[str]:
    """A line on a stated amplitude of which the lengths show nothing, where no recovery tells whether they could."""
    facts, test = trial.facts, _recorded(trial).get("test_stretch")
    amplitude = facts.amplitude_l0
    if amplitude is None or amplitude < _SMALLEST_COMPARED_L0 or facts.recovery_s is not None:
        return
    if test is not None and "conditioning_stretch" not in trial.phases_by_name():
        yield (
            f"amplitude_l0 is {amplitude:g} L0, but lengths from {trial.time_s[0]:.4g} s show no conditioning stretch "
            f"before the test stretch at {test.start_s:.4f} s; a trial without one has amplitude 0; where it was made "
            "before the record began, give the recovery"
        )


def _missing(trial: Trial, amplitude: float) -> Iterator[Belied]:
    """An amplitude whose stretch would lie within lengths that hold still there."""
    facts, test = trial.facts, _recorded(trial).get("test_stretch")
    if test is None or facts.recovery_s is None or amplitude <= 0.0:
        return
    if [phase.name for phase in facts.phases[:2]] != ["isometric", "test_stretch"]:
        return
    l0 = facts.reference_length_m
    speed = _amplitude(trial, test) * l0 / (test.end_s - test.start_s)
    if speed <= 0.0:
        return
    stretch = before(test.start_s, speed, amplitude * l0, facts.recovery_s)
    if stretch.peak_s > trial.time_s[0] and not leaves_room_for_stretch(trial.time_s, trial.length_m, stretch):
        what = (
            f"amplitude_l0 is {amplitude:g} L0 and recovery_s {facts.recovery_s:g} s, but lengths show no conditioning "
            f"stretch from {trial.time_s[0]:.4f} s to the test stretch at {test.start_s:.4f} s"
        )
        yield Belied("amplitude_l0", what, "correct them, or give amplitude 0 for a trial without one")


def _recovery(trial: Trial, phases: dict[str, Phase]) -> Iterator[Belied]:
    """A recovery that is not that between shortening and test stretch."""
    recovery, rest = trial.facts.recovery_s, phases.get("recovery")
    down, test = phases.get("shortening"), phases.get("test_stretch")
    if recovery is None:
        return
    if rest is not None and max(rest.end_s - rest.start_s, recovery) >= _SHORTEST_COMPARED_S:
        yield from _compared(rest.end_s - rest.start_s, recovery, "recovery_s", "s", rest)
        return
    if rest is None and down is not None and test is not None and recovery > least_pause_s(trial.time_s):
        what = f"recovery_s is {recovery:g} s, but the test stretch at {test.start_s:.4f} s has no pause before it"
        if down.end_s == test.start_s:
            yield Belied("recovery_s", what, "correct the one that is wrong")


def _recorded(trial: Trial) -> dict[str, Phase]:
    return {name: phase for name, phase in trial.phases_by_name().items() if _is_recorded(trial, phase)}


def _is_recorded(trial: Trial, phase: Phase) -> bool:
    """Whether lengths cover a phase; a record that begins or ends with it may have a part."""
    return bool(trial.time_s[0] < phase.start_s and phase.end_s <= trial.time_s[-1])


def _amplitude(trial: Trial, stretch: Phase) -> float:
    """What a stretch lengthens by, L0."""
    at = np.interp([stretch.start_s, stretch.end_s], trial.time_s, trial.length_change_l0)
    return float(at[1] - at[0])


def _apart(found: float, stated: float) -> bool:
    return abs(found - stated) > SHARE * abs(found)


def _compared(found: float, stated: float, name: str, unit: str, phase: Phase) -> Iterator[Belied]:
    if _apart(found, stated):
        what = (
            f"{name} is {stated:g} {unit}, but the {phase.name.replace('_', ' ')} at {phase.start_s:.4f} "
            f"s has {found:.4g} {unit}"
        )
        yield Belied(name, what, "correct the one that is wrong")
