"""Whether declared units make a muscle: what is possible, and yet more likely a unit that was named wrongly.

What no muscle has is refused where it is read; here is what deserves one line.
"""

from __future__ import annotations

import math

import numpy as np

from xb_muscle_ros.trials.readers.base import Draft, Signal
from xb_muscle_ros.trials.readers.description import ImportMapping
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
SARCOMERES_M = {"sarcomere": (1.6e-6, 3.8e-6), "half_sarcomere": (0.8e-6, 1.9e-6)}
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


def warn_of_length(draft: Draft, length_m: Array, reference_m: float) -> None:
    """Warn where L0 (m, or the length of a sarcomere) fits another unit or meaning, and where lengths are far off."""
    mapping, unit = draft.mapping, draft.mapping.length.unit_name
    if mapping.length.unit.kind == "length" and mapping.length_of in SARCOMERES_M:
        own = SARCOMERES_M[mapping.length_of]
        other = "sarcomere" if mapping.length_of == "half_sarcomere" else "half_sarcomere"
        fits = f"it fits a {_words(other)}: is it --length-of {other}?"
        why = fits if _within(reference_m, SARCOMERES_M[other]) else f"is {unit} its unit?"
        if not _within(reference_m, own):
            draft.warn(
                f"the length at rest is {1e6 * reference_m:.3g} µm; a {_words(mapping.length_of)} has "
                f"{1e6 * own[0]:g} to {1e6 * own[1]:g} µm; {why}"
            )
    elif mapping.l0_is_a_length:
        _usual(draft, reference_m, USUAL_L0_M, f"L0 is {reference_m:.6g} m", doubt_of_l0(mapping), " m")
    middle = float(np.median(length_m)) / reference_m
    found = f"the median length is {middle:.3g} L0 (L0 = {reference_m:.6g} m)"
    _usual(draft, middle, USUAL_LENGTH_L0, found, "check the reference length and the unit of length")


def doubt_of_l0(mapping: ImportMapping) -> str:
    """What to look at where L0 is no usual length."""
    if mapping.length.unit.kind == "relative length":
        return "is the reference length right?"
    return f"is {mapping.length.unit_name} its unit?"


def sarcomere_hint(reference_m: float) -> str:
    """What a length (m) that no fibre has may be; empty where it is no sarcomere's either."""
    fits = [f"--length-of {name}" for name, limits in SARCOMERES_M.items() if _within(reference_m, limits)]
    return f"it is that of a sarcomere: give {' or '.join(fits)}, or the right unit" if fits else ""


def warn_of_spikes(draft: Draft, signal: Signal, values: Array, limit: float, unit: str) -> None:
    """Warn where single samples leave both of their neighbours, to the same side, by more than a limit.

    Args:
        values: shape (n,), relative to L0 or F0.
        limit: what no single sample departs by, in the same unit.
        unit: its name.
    """
    if values.size < 3 or float(np.max(np.abs(np.diff(values)))) <= limit:
        return
    off = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    found = np.flatnonzero((off[0] * off[1] > 0.0) & (np.minimum(np.abs(off[0]), np.abs(off[1])) > limit)) + 1
    if found.size:
        i = int(found[0])
        more = f", the first of {found.size} such" if found.size > 1 else ""
        draft.warnings.append(
            f"{signal.place(draft.where, i)}: a single sample is at {values[i]:.4g} {unit} between "
            f"{values[i - 1]:.4g} and {values[i + 1]:.4g} {unit}{more}; mend it if it is a disturbance"
        )


def warn_of_time_step(draft: Draft, step_s: float) -> None:
    """Warn where samples are so near or far that the unit of time is in doubt."""
    low, high = USUAL_STEP_S
    if step_s < low or (step_s > high and draft.mapping.largest_step_s is None):
        draft.warn(
            f"samples are {step_s:.3g} s apart ({1.0 / step_s:.3g} Hz); usual is {1.0 / high:g} to {1.0 / low:g} Hz; "
            f"is {draft.mapping.time.unit_name} the unit of time?"
        )


def warn_of_calcium(draft: Draft, calcium_um: Array) -> None:
    """Warn where a concentration is one that no muscle is in."""
    column, top = draft.mapping.calcium, float(np.max(calcium_um))
    if column is not None and column.unit.kind == "calcium" and top > 0.0 and not _within(top, USUAL_CALCIUM_UM):
        draft.warn(
            f"calcium goes up to {top:.3g} µM (pCa {6.0 - math.log10(top):.3g}); usual is pCa 3 to 10; is "
            f"{column.unit_name} its unit?"
        )


def warn_of_force(draft: Draft, force_f0: Array, pca: float | None) -> None:
    """Warn where forces are far from F0."""
    if draft.mapping.force is None or force_f0.size == 0:
        return
    middle, top = float(np.median(force_f0)), float(np.max(np.abs(force_f0)))
    right = f"are f0 and the unit of force ({draft.mapping.force.unit_name}) right?"
    why = "is its sign reversed, or its zero off?" if middle < 0.0 else right
    _usual(draft, middle, USUAL_FORCE_F0, f"the median force is {middle:.3g} F0", why)
    if _within(middle, USUAL_FORCE_F0) and pca is not None and pca <= ACTIVE_PCA and top < LEAST_ACTIVE_F0:
        draft.warn(f"the largest force is {top:.3g} F0 at pCa {pca:g}, which activates muscle; {right}")


def warn_of_f0(draft: Draft, f0_n: float, reference_m: float) -> None:
    """Warn where F0 fits no stress, or force and length make no muscle: too wide for its length, or too thin."""
    mapping = draft.mapping
    if mapping.f0 is None or mapping.force is None:
        return
    unit = mapping.force.unit_name
    if mapping.f0.kind == "stress":
        pa = mapping.f0.value
        _usual(draft, pa, USUAL_F0_PA, f"F0 is {pa:.6g} Pa", f"is {unit} its unit?", " Pa")
        return
    if not mapping.l0_is_a_length or mapping.length_of != "fibre":
        return
    doubt = "is f0 right" if mapping.force.unit.kind == "relative force" else f"is {unit} the unit of force and f0"
    weak, strong = STRESS_PA
    least_m, most_m = (2.0 * math.sqrt(f0_n / (math.pi * stress)) for stress in (strong, weak))
    widest = next(ratio for longest_m, ratio in WIDEST_L0 if reference_m <= longest_m)
    if least_m > widest * reference_m:
        draft.warn(
            f"F0 = {f0_n:.6g} N takes a cross-section {1e3 * least_m:.3g} mm wide even at {strong / 1e3:g} kPa, with "
            f"L0 = {1e3 * reference_m:.4g} mm; {doubt} (or {mapping.length.unit_name} the unit of length)?"
        )
    elif most_m < THINNEST_M:
        draft.warn(
            f"F0 = {f0_n:.6g} N takes a cross-section {1e6 * most_m:.3g} µm wide even at {weak / 1e3:g} kPa, thinner "
            f"than a myofibril; {doubt}?"
        )


def _usual(draft: Draft, value: float, limits: tuple[float, float], found: str, why: str, unit: str = "") -> None:
    """Warn where a value is beyond what is usual."""
    if not _within(value, limits):
        draft.warn(f"{found}; usual is {limits[0]:g} to {limits[1]:g}{unit}; {why}")


def _words(kind: str) -> str:
    return kind.replace("_", "-")


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]
