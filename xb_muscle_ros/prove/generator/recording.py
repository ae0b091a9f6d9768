"""From what a fibre did to what the file says of it: faults of the measurement, and noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import SAMPLE_S

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Faults:
    """Faults of a study's measurement; the usual values are none.

    Attributes:
        pca_shift: true minus stated pCa, by stated pCa.
        length_gain: true over recorded length change, minus 1.
        run_down: share of its force that the fibre loses from trial to trial.
        offset: force recorded at no force, F0, for each trial.
        drift: rise of the recorded force, F0/s, for each trial.
        delay_s: by how much force is recorded later than length.
        lag_s: time constant of the force transducer.
    """

    pca_shift: Mapping[float, float] = field(default_factory=dict)
    length_gain: float = 0.0
    run_down: float = 0.0
    offset: tuple[float, ...] = ()
    drift: tuple[float, ...] = ()
    delay_s: float = 0.0
    lag_s: float = 0.0

    def recorded(self, force: Array, i: int) -> Array:
        """Force of trial i as it would be recorded without noise, F0, shape (n,)."""
        time_s = np.arange(force.size) * SAMPLE_S
        if self.lag_s > 0.0:
            force = _lagged(force, self.lag_s)
        if self.delay_s != 0.0:
            force = np.interp(time_s - self.delay_s, time_s, force)
        force = force * (1.0 - self.run_down) ** i
        return force + (self.offset[i] if self.offset else 0.0) + (self.drift[i] if self.drift else 0.0) * time_s


def _lagged(force: Array, lag_s: float) -> Array:
    """First-order low-pass of force that is straight between samples, from rest at the first sample."""
    left = np.exp(-SAMPLE_S / lag_s)
    ramp = lag_s / SAMPLE_S * (1.0 - left)
    # y[k] = left y[k-1] + (1 - ramp) x[k] + (ramp - left) x[k-1]
    out, _ = lfilter([1.0 - ramp, ramp - left], [1.0, -left], force - force[0], zi=np.zeros(1))
    return np.asarray(out + force[0])


class Prior(NamedTuple):
    """How large a fault is in an ordinary laboratory (one SD), and how many SDs a concealed one has."""

    sd: float
    least: float
    most: float


PRIORS: Mapping[str, Prior] = MappingProxyType(
    {
        Name.PCA_SHIFT.value: Prior(0.05, 1.2, 3.0),
        Name.RUN_DOWN.value: Prior(0.01, 1.5, 5.0),
        Name.FORCE_OFFSET.value: Prior(0.005, 2.0, 6.0),
        Name.FORCE_DRIFT.value: Prior(0.002, 3.0, 12.0),
        Name.LENGTH_GAIN.value: Prior(0.02, 2.0, 6.0),
        Name.TIME_SHIFT.value: Prior(5e-4, 2.0, 8.0),
        Name.TRANSDUCER_LAG.value: Prior(5e-4, 2.0, 8.0),
    }
)
"""By name of the fault."""


def draw_faults(name: str, random: np.random.Generator, study: Sequence[Planned]) -> Faults:
    """One fault of a size that is plausible and worth finding."""
    prior = PRIORS[name]

    def one(signed: bool = True) -> float:
        size = prior.sd * random.uniform(prior.least, prior.most)
        return float(size * (random.choice([-1.0, 1.0]) if signed else 1.0))

    if name == Name.PCA_SHIFT.value:
        between = sorted({trial.pca for trial in study if 4.5 < trial.pca < 9.0})
        count = int(random.integers(1, min(3, len(between)) + 1))
        return Faults(pca_shift={float(pca): one() for pca in random.choice(between, count, replace=False)})
    if name == Name.RUN_DOWN.value:
        return Faults(run_down=one(False))
    if name == Name.FORCE_OFFSET.value:
        return Faults(offset=tuple(one() for _ in study))
    if name == Name.FORCE_DRIFT.value:
        return Faults(drift=tuple(one() for _ in study))
    if name == Name.LENGTH_GAIN.value:
        return Faults(length_gain=one())
    if name == Name.TIME_SHIFT.value:
        return Faults(delay_s=one(False))
    return Faults(lag_s=one(False))


def noise(random: np.random.Generator, n: int, share: float) -> tuple[Array, float]:
    """Noise as a force transducer with a servo motor beside it has: slow, with hum where force is high.

    Args:
        random: decides.
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
