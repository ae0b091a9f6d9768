"""Whether declared units make a muscle: what is possible, and yet more likely a unit that was named wrongly.

What no muscle has is refused where it is read; here is what deserves one line.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.recording import Signal
from xb_muscle_ros.trials.trial import Array

# Isometric stress of muscle at full activation, weak to strong, Pa.
STRESS_PA = (1e5, 3e5)
# A muscle is no wider than so many fibre lengths, by the longest L0 (m) of its kind: pieces of fibres and trabeculae;
# muscles of small animals; pennate muscles of large ones (human soleus: 3 to 4).
WIDEST_L0 = ((3e-3, 0.5), (20e-3, 3.0), (math.inf, 5.0))
# A myofibril is about a micrometre thick.
THINNEST_M = 1e-6
USUAL_L0_M = (50e-6, 1.0)
USUAL_F0_PA = (1e3, 1e6)
# Lengths of sarcomeres in muscle, and of halves of them, m.
SARCOMERE_M = (1.6e-6, 3.8e-6)
HALF_SARCOMERE_M = (0.8e-6, 1.9e-6)
# Time between samples, s: 40 kHz to 20 Hz.
USUAL_STEP_S = (2.5e-5, 5e-2)
# Calcium with muscle in it, µM: pCa 10 to 3.
USUAL_CALCIUM_UM = (1e-4, 1e3)
USUAL_LENGTH_L0 = (0.45, 1.6)
# At this pCa and below muscle bears force; its largest is at least this part of F0.
ACTIVE_PCA = 6.0
LEAST_ACTIVE_F0 = 0.01
# A single sample further from both of its neighbours is a disturbance.
SPIKE_L0, SPIKE_F0 = 0.05, 1.0
# The median force of a trial lies within these, F0.
USUAL_FORCE_F0 = (-0.1, 3.0)


def length_doubts(where: str, mapping: ImportMapping, reference_m: float) -> Iterator[str]:
    """A line where L0 (m, or the length of a sarcomere) fits another unit or meaning."""
    if mapping.length.unit.kind != "length":
        return
    unit = mapping.length.unit_name
    ranges = {"sarcomere": SARCOMERE_M, "half_sarcomere": HALF_SARCOMERE_M}
    if mapping.length_of in ranges:
        other = "sarcomere" if mapping.length_of == "half_sarcomere" else "half_sarcomere"
        if not _within(reference_m, ranges[mapping.length_of]):
            low, high = (1e6 * each for each in ranges[mapping.length_of])
            fits = (
                f"it fits a {_words(other)}: is it --length-of {other}?" if _within(reference_m, ranges[other]) else ""
            )
            yield (
                f"{where}: the length at rest is {1e6 * reference_m:.3g} µm; a {_words(mapping.length_of)} has "
                f"{low:g} to {high:g} µm; {fits or f'is {unit} its unit?'}"
            )
    elif not _within(reference_m, USUAL_L0_M):
        low, high = USUAL_L0_M
        yield f"{where}: L0 is {reference_m:.6g} m; usual is {low:g} to {high:g} m; is {unit} its unit?"


def sarcomere_hint(reference_m: float) -> str:
    """What a length (m) that no fibre has may be; empty where it is no sarcomere's either."""
    kinds = (("sarcomere", SARCOMERE_M), ("half_sarcomere", HALF_SARCOMERE_M))
    fits = [f"--length-of {name}" for name, limits in kinds if _within(reference_m, limits)]
    return f"it is that of a sarcomere: give {' or '.join(fits)}, or the right unit" if fits else ""


def length_range_doubts(where: str, length_m: Array, reference_m: float) -> Iterator[str]:
    """A line where the lengths are far from L0."""
    middle = float(np.median(length_m)) / reference_m
    if not _within(middle, USUAL_LENGTH_L0):
        low, high = USUAL_LENGTH_L0
        yield (
            f"{where}: the median length is {middle:.3g} L0 (L0 = {reference_m:.6g} m); usual is {low:g} to {high:g}; "
            "check the reference length and the unit of length"
        )


def spikes(where: str, signal: Signal, values: Array, limit: float, unit: str) -> Iterator[str]:
    """A line where single samples leave both of their neighbours, to the same side, by more than a limit.

    Args:
        where: the trial, for messages.
        signal: whose values they are.
        values: shape (n,), relative to L0 or F0.
        limit: what no single sample departs by, in the same unit.
        unit: its name.
    """
    off = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    found = np.flatnonzero((off[0] * off[1] > 0.0) & (np.minimum(np.abs(off[0]), np.abs(off[1])) > limit)) + 1
    if found.size:
        i = int(found[0])
        more = f", the first of {found.size} such" if found.size > 1 else ""
        yield (
            f"{signal.place(where, i)}: a single sample is at {values[i]:.4g} {unit} between {values[i - 1]:.4g} and "
            f"{values[i + 1]:.4g} {unit}{more}; mend it if it is a disturbance"
        )


def time_doubts(where: str, mapping: ImportMapping, step_s: float) -> Iterator[str]:
    """A line where samples are so near or far that the unit of time is in doubt."""
    low, high = USUAL_STEP_S
    if step_s < low or (step_s > high and mapping.largest_step_s is None):
        yield (
            f"{where}: samples are {step_s:.3g} s apart ({1.0 / step_s:.3g} Hz); usual is {1.0 / high:g} to "
            f"{1.0 / low:g} Hz; is {mapping.time.unit_name} the unit of time?"
        )


def calcium_doubts(where: str, mapping: ImportMapping, calcium_um: Array) -> Iterator[str]:
    """A line where a concentration is one that no muscle is in."""
    if mapping.calcium is None or mapping.calcium.unit.kind != "calcium":
        return
    top = float(np.max(calcium_um))
    if top > 0.0 and not _within(top, USUAL_CALCIUM_UM):
        yield (
            f"{where}: calcium goes up to {top:.3g} µM (pCa {6.0 - math.log10(top):.3g}); usual is pCa 3 to 10; is "
            f"{mapping.calcium.unit_name} its unit?"
        )


def force_doubts(where: str, mapping: ImportMapping, force_f0: Array, pca: float | None) -> Iterator[str]:
    """A line where forces are far from F0."""
    if mapping.force is None or force_f0.size == 0:
        return
    middle, top = float(np.median(force_f0)), float(np.max(np.abs(force_f0)))
    unit = mapping.force.unit_name
    if not _within(middle, USUAL_FORCE_F0):
        low, high = USUAL_FORCE_F0
        why = f"are f0 and the unit of force ({unit}) right"
        if middle < 0.0:
            why = "is its sign reversed, or its zero off"
        yield f"{where}: the median force is {middle:.3g} F0; usual is {low:g} to {high:g}; {why}?"
    elif pca is not None and pca <= ACTIVE_PCA and top < LEAST_ACTIVE_F0:
        yield (
            f"{where}: the largest force is {top:.3g} F0 at pCa {pca:g}, which activates muscle; are f0 and the unit "
            f"of force ({unit}) right?"
        )


def f0_doubts(where: str, mapping: ImportMapping, f0_n: float, reference_m: float) -> Iterator[str]:
    """A line where F0 fits no stress, or force and length make no muscle: too wide for its length, or too thin."""
    if mapping.f0 is None or mapping.force is None:
        return
    unit = mapping.force.unit_name
    if mapping.f0.kind == "stress":
        if not _within(mapping.f0.value, USUAL_F0_PA):
            low, high = USUAL_F0_PA
            yield f"{where}: F0 is {mapping.f0.value:.6g} Pa; usual is {low:g} to {high:g} Pa; is {unit} its unit?"
        return
    if mapping.length.unit.kind != "length" or mapping.length_of != "fibre":
        return
    weak, strong = STRESS_PA
    least_m, most_m = (2.0 * math.sqrt(f0_n / (math.pi * stress)) for stress in (strong, weak))
    widest = next(ratio for longest_m, ratio in WIDEST_L0 if reference_m <= longest_m)
    if least_m > widest * reference_m:
        yield (
            f"{where}: F0 = {f0_n:.6g} N takes a cross-section {1e3 * least_m:.3g} mm wide even at {strong / 1e3:g} "
            f"kPa, with L0 = {1e3 * reference_m:.4g} mm; is {unit} the unit of force and f0 (or "
            f"{mapping.length.unit_name} that of length)?"
        )
    elif most_m < THINNEST_M:
        yield (
            f"{where}: F0 = {f0_n:.6g} N takes a cross-section {1e6 * most_m:.3g} µm wide even at {weak / 1e3:g} kPa, "
            f"thinner than a myofibril; is {unit} the unit of force and f0?"
        )


def _words(kind: str) -> str:
    return kind.replace("_", "-")


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]
