"""Exponential processes in complex stiffness against frequency (Kawai & Brandt 1980).

    Y(f) = H + A if/(a + if) - B if/(b + if) + C if/(c + if),        a < b < c

Each process answers a step of length with an exponential of the rate 2πa, 2πb, 2πc. One, two or three are fitted by
least squares: for given rates the others are linear, so that only the rates are searched, from the best of a grid. One
more process is taken where it is needed and where the data tell it:

- those so far leave more than half a percent of the modulus (root mean square over frequencies), or more than noise;
- an F-test gives it more than chance would (p < 0.01);
- its rate and magnitude are known (the 95 % interval of the magnitude leaves 0 out, that of a rate spans less than a
  factor of 10), the rate lies within the frequencies, and 1.5 times or more from its neighbour.

By sign a process is a lead (A, C) or a lag (B). Of two, a lag and a faster lead are B and C; a lead alone is listed as
C, a lag alone as B.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import optimize
from scipy.stats import f as fisher
from scipy.stats import t as student

from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.trials.trial import Array

Complex = npt.NDArray[np.complex128]
# Unexplained part of the modulus below which no further process is added.
_ENOUGH = 0.005
_CHANCE = 0.01
_WIDEST, _NEAREST = 10.0, 1.5
_MOST = 3
_TINY = 1e-300
# Rates of the grid that a search begins on, and of how many of its best points.
_GRID, _BEST = 14, 3
# A rate may be searched this far beyond the frequencies.
_BEYOND = 3.0


class Process(NamedTuple):
    """One exponential process.

    Attributes:
        name: A, B or C.
        rate_per_s: 2π times its characteristic frequency, 1/s.
        magnitude: F0/L0, by Kawai's sign: that of B counts downwards.
        rate_log_se: standard error of the rate's natural logarithm.
        magnitude_se: F0/L0.
    """

    name: str
    rate_per_s: float
    magnitude: float
    rate_log_se: float
    magnitude_se: float


class Processes(NamedTuple):
    """What fits best.

    Attributes:
        base: H, the modulus at frequency 0, F0/L0.
        base_se: F0/L0.
        processes: in order of rate.
        rmsd: root mean square of what the fit leaves, F0/L0.
        share: the same over the root mean square of the modulus.
        width: standard errors to either side that make a 95 % interval.
        why: why there is not one process more; in words.
    """

    base: float
    base_se: float
    processes: tuple[Process, ...]
    rmsd: float
    share: float
    width: float
    why: str

    def at(self, frequency_hz: Array) -> Complex:
        """Complex modulus, F0/L0, shape (n,)."""
        found = np.full(np.shape(frequency_hz), self.base, dtype=complex)
        for process in self.processes:
            sign = -1.0 if process.name == "B" else 1.0
            found += sign * process.magnitude * _lead(frequency_hz, process.rate_per_s / (2.0 * np.pi))
        return found


class _Fit(NamedTuple):
    """Least squares of some processes: H, then signed magnitudes, then logarithms of frequencies; sum of squares."""

    values: Array
    covariance: Array
    squares: float
    freedom: int

    @property
    def processes(self) -> int:
        return (self.values.size - 1) // 2


def fit_processes(frequency_hz: Array, modulus: Complex, se: Complex | None = None) -> Processes | Missing:
    """Fit one to three processes.

    Args:
        frequency_hz, modulus: shape (n,), Hz and F0/L0; those of one frequency may be several.
        se: standard errors of the real and of the imaginary parts, shape (n,); None: all the same, not known.

    Returns:
        nothing for fewer than 3 frequencies, or where the modulus does not depend on frequency as one process does.
    """
    levels = np.unique(frequency_hz).size
    if levels < _FEWEST[1]:
        return Missing(f"complex stiffness is known at {levels} frequencies; {_FEWEST[1]} are needed for one process")
    y = np.concatenate([modulus.real, modulus.imag])
    spread = None if se is None else np.concatenate([se.real, se.imag])
    known = spread is not None and bool(np.all(np.isfinite(spread) & (spread > 0.0)))
    weight = 1.0 / spread if known and spread is not None else np.full(y.size, 1.0)
    spring = float(np.mean(modulus.real))
    left = math.sqrt(float(np.mean(np.abs(modulus - spring) ** 2) / np.mean(np.abs(modulus) ** 2)))
    if left < _ENOUGH:
        return Missing(f"a spring of {spring:.3g} F0/L0 leaves {100.0 * left:.2g} % of the modulus at all frequencies")
    best: _Fit | None = None
    why = ""
    for count in range(1, _MOST + 1):
        if best is not None and (enough := _enough(best, y, weight, known)):
            why = enough
            break
        if levels < _FEWEST[count]:
            why = why or f"{levels} frequencies; {_FEWEST[count]} are needed for {count} processes"
            break
        fit = _fit(frequency_hz, y, weight, count, known)
        # Where two processes do not describe the data, three may.
        if unsound := _unsound(fit, best, frequency_hz):
            why = why or unsound
        else:
            best, why = fit, ""
    if best is None:
        return Missing(f"no exponential process is told: {why}")
    return _told(best, frequency_hz, y, why or "Kawai's model has three")


_FEWEST = {1: 3, 2: 5, 3: 7}


def _lead(frequency_hz: Array, corner_hz: float) -> Complex:
    made: Complex = 1j * frequency_hz / (corner_hz + 1j * frequency_hz)
    return made


def _columns(frequency_hz: Array, logs: Array) -> Array:
    """Real columns of H and of each process, real parts above imaginary parts, shape (2n, 1 + processes)."""
    leads = [_lead(frequency_hz, math.exp(log)) for log in logs]
    top = np.column_stack([np.ones(frequency_hz.size), *(lead.real for lead in leads)])
    low = np.column_stack([np.zeros(frequency_hz.size), *(lead.imag for lead in leads)])
    return np.vstack([top, low])


def _linear(frequency_hz: Array, y: Array, weight: Array, logs: Array) -> tuple[Array, Array]:
    """H and magnitudes for given rates, and weighted residuals."""
    columns = _columns(frequency_hz, logs) * weight[:, None]
    values = np.linalg.lstsq(columns, y * weight, rcond=None)[0]
    return values, columns @ values - y * weight


def _fit(frequency_hz: Array, y: Array, weight: Array, count: int, known: bool) -> _Fit:
    low, high = (math.log(f) for f in (frequency_hz.min() / _BEYOND, frequency_hz.max() * _BEYOND))
    grid = np.linspace(low, high, _GRID + 2)[1:-1]
    starts = [np.array(logs) for logs in itertools.combinations(grid, count)]
    sums = [float(np.sum(_linear(frequency_hz, y, weight, logs)[1] ** 2)) for logs in starts]

    def rest(logs: Array) -> Array:
        return _linear(frequency_hz, y, weight, logs)[1]

    search: Any = optimize.least_squares
    tried = [
        search(rest, starts[k], bounds=(low, high), xtol=1e-10, ftol=1e-12, gtol=1e-12, max_nfev=200)
        for k in np.argsort(sums)[:_BEST]
    ]
    logs = np.sort(min(tried, key=lambda one: one.cost).x)
    values, left = _linear(frequency_hz, y, weight, logs)
    slopes = []
    for log, magnitude in zip(logs, values[1:], strict=True):
        lead = _lead(frequency_hz, math.exp(log))
        slope = -magnitude * lead * (1.0 - lead)
        slopes.append(np.concatenate([slope.real, slope.imag]))
    jacobian = np.column_stack([_columns(frequency_hz, logs), *slopes]) * weight[:, None]
    squares, freedom = float(left @ left), y.size - 2 * count - 1
    scale = squares / freedom
    # With known noise what is left may still be more than noise; never does chance make it count for less.
    size = max(scale, 1.0) if known else scale
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * size
    return _Fit(np.concatenate([values, logs]), covariance, squares, freedom)


def _enough(fit: _Fit, y: Array, weight: Array, known: bool) -> str:
    """Why no further process is needed; empty where one may be."""
    share = math.sqrt(fit.squares / float(np.sum((y * weight) ** 2)))
    if share < _ENOUGH:
        return f"{_words(fit.processes)} {100.0 * share:.2g} % of the modulus, less than {100.0 * _ENOUGH:g} %"
    if known and fit.squares < fit.freedom:
        return f"{_words(fit.processes)} no more than noise"
    return ""


def _words(count: int) -> str:
    return "one process leaves" if count == 1 else f"{count} processes leave"


def _unsound(fit: _Fit, before: _Fit | None, frequency_hz: Array) -> str:
    """Why the last process is not told by the data; empty where it is."""
    count = fit.processes
    if before is not None:
        more = 2 * (count - before.processes)
        gain = (before.squares - fit.squares) / more / max(fit.squares / fit.freedom, _TINY)
        if fisher.sf(gain, more, fit.freedom) > _CHANCE:
            return f"{'a second' if count == 2 else 'a third'} process explains no more than chance would"
    errors = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    width = float(student.ppf(0.975, fit.freedom))
    magnitudes, logs = fit.values[1 : 1 + count], fit.values[1 + count :]
    for k in range(count):
        what = "" if count == 1 else f"of {count} processes "
        if not frequency_hz.min() <= math.exp(logs[k]) <= frequency_hz.max():
            return f"{what}one would have its frequency, {math.exp(logs[k]):.3g} Hz, outside those measured"
        if abs(magnitudes[k]) <= width * errors[1 + k]:
            return f"{what}one would have a magnitude of {magnitudes[k]:.3g} ± {errors[1 + k]:.2g} F0/L0"
        if 2.0 * width * errors[1 + count + k] > math.log(_WIDEST):
            return f"{what}one would have a rate that is known to a factor of {_WIDEST:g} or less well"
    if np.any(np.diff(logs) < math.log(_NEAREST)):
        near = np.exp(logs) * 2.0 * np.pi
        rates = " and ".join(f"{rate:.3g}" for rate in near)
        return f"{count} processes would have rates too near to each other ({rates} 1/s)"
    return ""


def _names(magnitudes: Array) -> str:
    if magnitudes.size == _MOST:
        return "ABC"
    if magnitudes.size == 1:
        return "C" if magnitudes[0] > 0.0 else "B"
    if magnitudes[0] < 0.0 < magnitudes[1]:
        return "BC"
    return "AB" if magnitudes[1] < 0.0 else "AC"


def _told(fit: _Fit, frequency_hz: Array, y: Array, why: str) -> Processes:
    count = fit.processes
    errors = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    magnitudes, logs = fit.values[1 : 1 + count], fit.values[1 + count :]
    processes = tuple(
        Process(
            name,
            2.0 * np.pi * math.exp(logs[k]),
            float(-magnitudes[k] if name == "B" else magnitudes[k]),
            float(errors[1 + count + k]),
            float(errors[1 + k]),
        )
        for k, name in enumerate(_names(magnitudes))
    )
    left = _columns(frequency_hz, logs) @ fit.values[: 1 + count] - y
    # Of complex numbers: real and imaginary parts of one belong together.
    rmsd = math.sqrt(float(np.sum(left**2)) / frequency_hz.size)
    whole = math.sqrt(float(np.sum(y**2)) / frequency_hz.size)
    width = float(student.ppf(0.975, fit.freedom))
    return Processes(float(fit.values[0]), float(errors[0]), processes, rmsd, rmsd / whole, width, why)
