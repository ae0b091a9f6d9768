"""Noise of a force transducer with a servo motor beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.prove.generator.world import SAMPLE_S
from xb_muscle_ros.trials.trial import Array


def noise(random: np.random.Generator, n: int, share: float) -> tuple[Array, float]:
    """Slow noise, with hum where force is high.

    Args:
        n: number of samples, 1 ms apart.
        share: isometric force relative to that at pCa 4.5.

    Returns:
        Noise in F0, shape (n,), lag-1 autocorrelation 0.91 to 0.98; its SD over long times, F0.
    """
    sd = 1e-4 * (random.uniform(3.0, 6.0) + random.uniform(2.0, 8.0) * min(max(share, 0.0), 1.0))
    rho = random.uniform(0.92, 0.98)
    slow = _filtered(random, n, [1.0, -rho])
    frequency, radius = random.uniform(40.0, 62.0), 0.985
    hum = _filtered(random, n, [1.0, -2.0 * radius * np.cos(2.0 * np.pi * frequency * SAMPLE_S), radius**2])
    part = 0.7 * min(max(share, 0.0), 1.0)
    return sd * (np.sqrt(1.0 - part) * slow + np.sqrt(part) * hum), float(sd)


def _filtered(random: np.random.Generator, n: int, poles: Sequence[float]) -> Array:
    """Autoregressive noise of SD 1, in its steady state."""
    warm = 1000
    response = lfilter([1.0], poles, np.r_[1.0, np.zeros(3000)])
    drawn = lfilter([1.0], poles, random.standard_normal(n + warm))
    return np.asarray(drawn[warm:] / np.sqrt(np.sum(response**2)))
