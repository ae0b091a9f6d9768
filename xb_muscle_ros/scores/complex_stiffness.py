"""Complex stiffness at one frequency: force over length, by least squares of sine and cosine.

Force and length are fitted over the same samples by the same columns: cosine and sine of the frequency and of its
second harmonic, a level and a line for drift. So any length of record counts, whole cycles or not, and a length that is
not a pure sinusoid enters by the coefficient that it has. Their quotient is the elastic modulus (real part) and the
viscous modulus (imaginary part). From six cycles on their standard errors come from the scatter among single cycles:
what counts is noise at this frequency, which a shorter quiet time does not tell. For fewer cycles they come from the
noise of the quiet times (`ForceNoise`), the moduli being weighted sums of force; where that is not known, from the
scatter of four or five cycles.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.cycles import sinusoid_columns
from xb_muscle_ros.scores.estimate import Estimate, Missing, rounded
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

# Samples in a cycle that sine and cosine need, and those that the second harmonic needs too.
_FEWEST, _FOR_SECOND = 4.0, 8.0
# Cycles whose scatter tells a standard error, in place of quiet times and where there are none.
_SCATTER, _LEAST_SCATTER = 6, 4


class ComplexStiffness(NamedTuple):
    """What force does at the frequency of length.

    Attributes:
        frequency_hz: Hz.
        amplitude_l0: of length, L0.
        elastic, viscous: moduli in phase with length and a quarter of a cycle before it, F0/L0.
        magnitude: F0/L0.
        phase_deg: by which force is ahead of length, degrees.
        second: amplitude of force's second harmonic over that of the first; None where samples are too few for it.
        cycles: in the samples, whole or not.
        from_scatter: standard errors are from the scatter among cycles.
    """

    frequency_hz: float
    amplitude_l0: float
    elastic: Estimate
    viscous: Estimate
    magnitude: Estimate
    phase_deg: Estimate
    second: float | None
    cycles: float
    from_scatter: bool = False

    @property
    def value(self) -> complex:
        """Elastic modulus + i · viscous modulus, F0/L0."""
        assert self.elastic.value is not None
        assert self.viscous.value is not None
        return complex(self.elastic.value, self.viscous.value)


def complex_stiffness(
    time_s: Array,
    length_l0: Array,
    force_f0: Array,
    frequency_hz: float,
    noise: ForceNoise | None = None,
    measured: bool = False,
) -> ComplexStiffness | Missing:
    """Complex stiffness at a frequency.

    Args:
        time_s, length_l0, force_f0: shape (n,), s, L0 and F0, over at least one cycle.
        frequency_hz: of length.
        noise: of a measured force.
        measured: the force has noise; a model's has no standard errors.

    Returns:
        nothing where there is less than a cycle, or samples are too few.
    """
    if time_s.size < 2:
        return Missing(f"{time_s.size} samples do not tell a stiffness")
    span_s = float(time_s[-1] - time_s[0]) * time_s.size / (time_s.size - 1)
    cycles = span_s * frequency_hz
    each = time_s.size / cycles
    if cycles < 1.0 - 1e-6:
        return Missing(f"{cycles:.2f} of a cycle at {frequency_hz:.4g} Hz; a whole one is needed")
    if each < _FEWEST:
        return Missing(f"{each:.2g} samples for each cycle of {frequency_hz:.4g} Hz; {_FEWEST:g} are needed")
    harmonics = 2 if each >= _FOR_SECOND else 1
    design = sinusoid_columns(time_s - time_s[0], frequency_hz, harmonics)
    weights = np.linalg.pinv(design).T
    first = weights[:, 0] - 1j * weights[:, 1]
    of_length = complex(first @ length_l0)
    if of_length == 0.0:
        return Missing(f"length does not move at {frequency_hz:.4g} Hz")
    # The modulus is this weighted sum of force.
    by = first / of_length
    found = complex(by @ force_f0)
    second = None
    if harmonics == 2:
        twice = complex((weights[:, 2] - 1j * weights[:, 3]) @ force_f0)
        second = abs(twice) / abs(found * of_length) if found else None
    covariance = None
    scattered = measured and cycles >= (_SCATTER if noise is not None else _LEAST_SCATTER) - 1e-6
    if scattered:
        covariance = _scatter(time_s, length_l0, force_f0, frequency_hz)
    elif noise is not None:
        covariance = noise.covariance(np.column_stack([by.real, by.imag]), time_s)
    return ComplexStiffness(
        frequency_hz,
        abs(of_length),
        *_estimates(found, covariance),
        second,
        cycles,
        scattered,
    )


def _estimates(found: complex, covariance: Array | None) -> tuple[Estimate, Estimate, Estimate, Estimate]:
    """Both moduli, magnitude and phase (degrees); errors of the last two to first order."""
    size, phase = abs(found), math.degrees(math.atan2(found.imag, found.real))
    if covariance is None:
        return Estimate(found.real), Estimate(found.imag), Estimate(size), Estimate(phase)
    along = np.array([found.real, found.imag]) / size
    across = np.array([-along[1], along[0]])
    errors = [math.sqrt(max(float(v @ covariance @ v), 0.0)) for v in (*np.eye(2), along, across)]
    errors[3] = math.degrees(errors[3] / size)
    values = (found.real, found.imag, size, phase)
    made = [Estimate(value, rounded(error)) for value, error in zip(values, errors, strict=True)]
    return made[0], made[1], made[2], made[3]


def _scatter(time_s: Array, length_l0: Array, force_f0: Array, frequency_hz: float) -> Array:
    """Covariance (2, 2) of the moduli's mean over cycles, from those of single cycles."""
    count = int((time_s[-1] - time_s[0]) * frequency_hz + 1e-6)
    edges = time_s[0] + np.arange(count + 1) / frequency_hz
    bounds = np.searchsorted(time_s, edges - 1e-9 / frequency_hz)
    both = np.column_stack([force_f0, length_l0])
    # A line of each cycle's own would take from its sine; drift is taken out of all together.
    drift = sinusoid_columns(time_s - time_s[0], frequency_hz, 1)
    both = both - np.outer(drift[:, -1], np.linalg.lstsq(drift, both, rcond=None)[0][-1])
    each = []
    for begin, end in itertools.pairwise(bounds):
        one = slice(int(begin), int(end))
        force, length = np.linalg.lstsq(drift[one, :-1], both[one], rcond=None)[0].T
        modulus = (force[0] - 1j * force[1]) / (length[0] - 1j * length[1])
        each.append([modulus.real, modulus.imag])
    covariance: Array = np.cov(np.array(each).T) / len(each)
    return covariance
