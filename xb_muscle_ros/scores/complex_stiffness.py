"""Complex stiffness at one frequency: force over length, by least squares of sine and cosine.

Force and length are fitted at their own samples by the same columns: cosine and sine of the frequency and of its second
harmonic, a level and a line for drift. Length read between its samples would lose amplitude. Any length of
record counts, whole cycles or not, and a length that is not a pure sinusoid enters by the coefficient that it has.
Their quotient is the elastic modulus (real part) and the viscous modulus (imaginary part). From six cycles on their
standard errors come from the scatter among single cycles: what counts is noise at this frequency, which a shorter quiet
time does not tell. For fewer cycles they come from the noise of the quiet times (`ForceNoise`), the moduli being
weighted sums of force; where that is not known, from the scatter of four or five cycles.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.cycles import sinusoid_columns
from xb_muscle_ros.scores.estimate import Estimate, Missing, rounded, samples
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


class Trace(NamedTuple):
    """Samples of length (L0) or force (F0) and their times (s), shape (n,) each."""

    time_s: Array
    value: Array


def complex_stiffness(
    length: Trace,
    force: Trace,
    frequency_hz: float,
    noise: ForceNoise | None = None,
    measured: bool = False,
) -> ComplexStiffness | Missing:
    """Complex stiffness at a frequency.

    Args:
        length, force: over at least one cycle, the same ones; each at its own times.
        frequency_hz: of length.
        noise: of a measured force.
        measured: the force has noise; a model's has no standard errors.

    Returns:
        nothing where there is less than a cycle, or samples are too few.
    """
    for what, trace in (("force", force), ("length", length)):
        if trace.time_s.size < 2:
            return Missing(f"there is no stiffness in {samples(trace.time_s.size)} of {what}")
    cycles = _cycles(force, frequency_hz)
    if cycles < 1.0 - 1e-6:
        return Missing(f"{cycles:.2f} of a cycle at {frequency_hz:.4g} Hz; a whole one is needed")
    for what, trace in (("force", force), ("length", length)):
        each = trace.time_s.size / _cycles(trace, frequency_hz)
        if each < _FEWEST:
            return Missing(
                f"{each:.2g} samples of {what} for each cycle of {frequency_hz:.4g} Hz; {_FEWEST:g} are needed"
            )
    time_s, origin = force.time_s, float(force.time_s[0])
    harmonics = _harmonics(force, frequency_hz)
    weights = np.linalg.pinv(sinusoid_columns(time_s - origin, frequency_hz, harmonics)).T
    first = weights[:, 0] - 1j * weights[:, 1]
    # Of the same times as force, length has the same columns.
    alike = np.array_equal(length.time_s, time_s)
    of_length = complex(first @ length.value) if alike else _coefficient(length, frequency_hz, origin)
    if of_length == 0.0:
        return Missing(f"length does not move at {frequency_hz:.4g} Hz")
    # The modulus is this weighted sum of force.
    by = first / of_length
    found = complex(by @ force.value)
    second = None
    if harmonics == 2:
        twice = complex((weights[:, 2] - 1j * weights[:, 3]) @ force.value)
        second = abs(twice) / abs(found * of_length) if found else None
    covariance = None
    scattered = measured and cycles >= (_SCATTER if noise is not None else _LEAST_SCATTER) - 1e-6
    if scattered:
        covariance = _scatter(length, force, frequency_hz)
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


def _cycles(trace: Trace, frequency_hz: float) -> float:
    """How many are in the samples, each of which counts for the time to the next."""
    count = trace.time_s.size
    return float(trace.time_s[-1] - trace.time_s[0]) * count / (count - 1) * frequency_hz


def _harmonics(trace: Trace, frequency_hz: float) -> int:
    return 2 if trace.time_s.size / _cycles(trace, frequency_hz) >= _FOR_SECOND else 1


def _coefficient(trace: Trace, frequency_hz: float, origin_s: float) -> complex:
    """Of cosine, less i times that of sine, which begin at a time."""
    design = sinusoid_columns(trace.time_s - origin_s, frequency_hz, _harmonics(trace, frequency_hz))
    cosine, sine = np.linalg.lstsq(design, trace.value, rcond=None)[0][:2]
    return complex(cosine, -sine)


def _scatter(length: Trace, force: Trace, frequency_hz: float) -> Array:
    """Covariance (2, 2) of the moduli's mean over cycles, from those of single cycles."""
    origin = float(force.time_s[0])
    count = int((float(force.time_s[-1]) - origin) * frequency_hz + 1e-6)
    # A cycle's end is found despite rounding.
    edges = origin + (np.arange(count + 1) - 1e-9) / frequency_hz
    of_length, of_force = (_of_each(trace, frequency_hz, origin, edges) for trace in (length, force))
    moduli = of_force / of_length
    covariance: Array = np.cov(np.array([moduli.real, moduli.imag])) / count
    return covariance


def _of_each(trace: Trace, frequency_hz: float, origin_s: float, edges_s: Array) -> npt.NDArray[np.complex128]:
    """`_coefficient` of single cycles, shape (cycles,)."""
    design = sinusoid_columns(trace.time_s - origin_s, frequency_hz, 1)
    # A line of each cycle's own would take from its sine; drift is taken out of all together.
    level = trace.value - design[:, -1] * np.linalg.lstsq(design, trace.value, rcond=None)[0][-1]
    found = []
    for begin, end in itertools.pairwise(np.searchsorted(trace.time_s, edges_s).tolist()):
        cosine, sine = np.linalg.lstsq(design[begin:end, :-1], level[begin:end], rcond=None)[0][:2]
        found.append(complex(cosine, -sine))
    return np.array(found)
