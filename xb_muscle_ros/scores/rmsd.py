"""Root-mean-square deviation of force in the paper's windows."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.scores.estimate import samples
from xb_muscle_ros.trials.protocol import TEST_DURATION_S
from xb_muscle_ros.trials.trial import Array, Trial

# The paper's whole window reaches one test stretch's duration beyond the stretches on either side.
MARGIN_S = TEST_DURATION_S
# One or two samples happen to be near or far.
FEWEST = 3


def windows(trial: Trial) -> dict[str, tuple[float, float] | None]:
    """Time windows (s) named ``whole``, ``conditioning`` and ``test``; None where the trial lacks the phase.

    ``whole`` runs from 0.0843 s before the first stretch to 0.0843 s after the test stretch (van der Zee et al. 2026),
    as far as the trial goes; trials of other protocols are taken whole.
    """
    phases = trial.phases_by_name()
    conditioning, test = phases.get("conditioning_stretch"), phases.get("test_stretch")
    start, end = float(trial.time_s[0]), float(trial.time_s[-1])
    whole = (start, end)
    first = conditioning or test
    if first is not None and test is not None:
        whole = (max(start, first.start_s - MARGIN_S), min(end, test.end_s + MARGIN_S))
    return {
        "whole": whole,
        "conditioning": (conditioning.start_s, conditioning.end_s) if conditioning else None,
        "test": (test.start_s, test.end_s) if test else None,
    }


def force_rmsd(time_s: Array, simulated: Array, measured: Array, window: tuple[float, float] | None) -> float | None:
    """Root-mean-square of simulated - measured within a window, in the unit of the forces.

    Args:
        time_s, simulated, measured: shape (n,), at the same times.
        window: start and end, s, both inclusive; None gives None.

    Returns:
        None where fewer than 3 samples lie in the window.
    """
    return _rms(time_s, simulated - measured, window)


def _rms(time_s: Array, off: Array, window: tuple[float, float] | None) -> float | None:
    if window is None:
        return None
    inside = _inside(time_s, window)
    if inside.stop - inside.start < FEWEST:
        return None
    return float(np.sqrt(np.mean(np.square(off[inside]))))


def force_rmsds(trial: Trial, time_s: Array, force_f0: Array) -> dict[str, float | None]:
    """RMSD (F0) of a simulated force at the measured samples by the names of `windows`; None as in `force_rmsd`.

    Args:
        trial: as measured; without measured force there is no RMSD.
        time_s, force_f0: simulated, shape (n,), s and F0.
    """
    at_measured = force_f0 if trial.force_time_s is time_s else np.interp(trial.force_time_s, time_s, force_f0)
    off = at_measured - trial.measured_f0
    del at_measured  # of an hour at 1 kHz each array has 29 MB
    return {name: _rms(trial.force_time_s, off, window) for name, window in windows(trial).items()}


def short_windows(trial: Trial) -> dict[str, str]:
    """Why windows that a trial with measured force has leave no RMSD, in words, by name."""
    if not trial.force_time_s.size:
        return {}
    parts = {name: _inside(trial.force_time_s, window) for name, window in windows(trial).items() if window is not None}
    counts = {name: part.stop - part.start for name, part in parts.items()}
    return {name: f"{samples(count)} in the window; 3 are needed" for name, count in counts.items() if count < FEWEST}


def _inside(time_s: Array, window: tuple[float, float]) -> slice:
    # Half a nanosecond of grace: phases are computed, stamps are whole nanoseconds.
    first = int(np.searchsorted(time_s, window[0] - 5e-10))
    return slice(first, max(first, int(np.searchsorted(time_s, window[1] + 5e-10, side="right"))))
