"""A recording with artefacts: what the fibre was really given, and what the file holds of its force."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from xb_muscle_ros.trials.trial import Array


def given_calcium(calcium_um: Array, artefacts: Mapping[str, float]) -> Array:
    """Calcium that really acted, µM, from the stated one: pCa is higher by ``pca_shift``."""
    return calcium_um * float(10.0 ** -artefacts.get("pca_shift", 0.0))


def given_length(length_change_l0: Array, artefacts: Mapping[str, float]) -> Array:
    """Length change that really happened, L0, from the recorded one: larger by ``length_gain``."""
    return length_change_l0 * (1.0 + artefacts.get("length_gain", 0.0))


def recorded_force(time_s: Array, force_f0: Array, artefacts: Mapping[str, float], order: int = 0) -> Array:
    """Force as the file holds it: lagged, late, run down, offset and drifting, in this order.

    Args:
        time_s: shape (n,), increasing, s.
        force_f0: shape (n,), the fibre's force, F0.
        artefacts: values by name of `artefacts.ARTEFACTS`; those of the input have no part in it.
        order: how many trials the fibre had behind it.

    Returns:
        Shape (n,), F0; drift counts from the first sample.
    """
    lag, shift = artefacts.get("transducer_lag", 0.0), artefacts.get("time_shift", 0.0)
    force = force_f0
    if lag > 0.0:
        force = _lagged(time_s, force, lag)
    if shift != 0.0:
        force = np.interp(time_s - shift, time_s, force)
    remaining = (1.0 - artefacts.get("run_down", 0.0)) ** order
    drift = artefacts.get("force_drift", 0.0) * (time_s - time_s[0])
    return np.asarray(remaining * force + artefacts.get("force_offset", 0.0) + drift)


@njit(cache=True)
def _lagged(time_s: Array, force: Array, lag_s: float) -> Array:
    """First-order low-pass, exact for force that is straight between samples, from rest at the first."""
    out = np.empty_like(force)
    out[0] = force[0]
    for k in range(1, force.size):
        dt = time_s[k] - time_s[k - 1]
        slope = (force[k] - force[k - 1]) / dt
        decay = np.exp(-dt / lag_s)
        out[k] = force[k] - lag_s * slope + (out[k - 1] - force[k - 1] + lag_s * slope) * decay
    return out
