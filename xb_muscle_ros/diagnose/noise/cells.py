"""Trials cut into cells, one for each phase of each trial, and the size of a residual in each."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array, Phase

# What length changes leave behind passes fast at first, s; pauses longer than twice this are cut there.
EARLY_S = 0.1
# A phase with fewer samples goes to a neighbour.
LEAST_SAMPLES = 8
_PAUSES = ("recovery", "hold")
# Half a nanosecond of grace: phases are computed, stamps are whole nanoseconds.
_GRACE_S = 5e-10


class Residual(NamedTuple):
    """Measured minus simulated force of one trial.

    Attributes:
        pca: None where calcium changes.
        time_s: shape (n,), increasing, s.
        value_f0: shape (n,), measured minus simulated, F0.
        length_l0: shape (n,), length change at these times, L0.
        calcium_um: shape (n,), µM.
    """

    trial: str
    pca: float | None
    time_s: Array
    value_f0: Array
    phases: tuple[Phase, ...]
    length_l0: Array
    calcium_um: Array


class Cell(NamedTuple):
    """Some samples of one trial.

    Attributes:
        phase: name of the phase; ``_early`` and ``_late`` are parts of it, a number tells the second from the first.
        start_s, end_s: time of the first sample and of the last.
        begin, end: samples, counted through all trials, `end` not included.
    """

    trial: str
    phase: str
    start_s: float
    end_s: float
    begin: int
    end: int


def check(residuals: Sequence[Residual]) -> None:
    """Check that residuals can be looked at.

    Raises:
        UserError: there are none, one is empty, not finite, of a wrong shape or not in order of time, or two share a
            name.
    """  # fmt: skip
    if not residuals:
        raise UserError("no trial to look for a mismatch in; give at least one with measured force")
    names = [r.trial for r in residuals]
    for r in residuals:
        n = r.time_s.size
        if names.count(r.trial) > 1:
            raise UserError(f"trial {r.trial} is there {names.count(r.trial)} times; give each trial once")
        if not n or any(a.shape != (n,) for a in (r.value_f0, r.length_l0, r.calcium_um)):
            sizes = ", ".join(str(a.size) for a in (r.time_s, r.value_f0, r.length_l0, r.calcium_um))
            raise UserError(
                f"trial {r.trial}: {sizes} samples of time, residual, length and calcium; needed is one each"
            )
        if not np.all(np.isfinite(r.value_f0)):
            raise UserError(f"trial {r.trial}: the residual is not finite; leave the trial out")
        if np.any(np.diff(r.time_s) <= 0.0):
            raise UserError(f"trial {r.trial}: times of the residual do not increase; sort the samples")


def slices(residuals: Sequence[Residual], samples: int) -> list[slice]:
    """Where the samples of each trial are, all one below the other.

    Raises:
        UserError: a fit's slopes have another number of samples.
    """
    edges = np.cumsum([0, *(r.time_s.size for r in residuals)]).tolist()
    if edges[-1] != samples:
        raise UserError(f"residuals have {edges[-1]} samples, the fit's slopes {samples}; give the same")
    return [slice(a, b) for a, b in itertools.pairwise(edges)]


def cut(residuals: Sequence[Residual]) -> tuple[Cell, ...]:
    """All cells, in order; together they hold every sample once.

    Raises:
        UserError: see `check`.
    """
    check(residuals)
    cells: list[Cell] = []
    first = 0
    for r in residuals:
        for name, begin, end in _parts(r):
            cells.append(
                Cell(r.trial, name, float(r.time_s[begin]), float(r.time_s[end - 1]), first + begin, first + end)
            )
        first += r.time_s.size
    return tuple(cells)


def _parts(r: Residual) -> list[tuple[str, int, int]]:
    """Name, first sample and end of each part of a trial; time before the first phase and after the last is theirs."""
    n = r.time_s.size
    names, starts_s = ["whole"] if not r.phases else [], [-np.inf] if not r.phases else []
    seen: dict[str, int] = {}
    for phase in r.phases:
        seen[phase.name] = seen.get(phase.name, 0) + 1
        name = phase.name if seen[phase.name] == 1 else f"{phase.name}_{seen[phase.name]}"
        split = phase.name in _PAUSES and phase.end_s - phase.start_s > 2.0 * EARLY_S
        names += [f"{name}_early", f"{name}_late"] if split else [name]
        starts_s += [phase.start_s, phase.start_s + EARLY_S] if split else [phase.start_s]
    edges = [0, *(int(e) for e in np.searchsorted(r.time_s, np.array(starts_s[1:]) - _GRACE_S)), n]
    return _merged([(name, a, b) for name, a, b in zip(names, edges[:-1], edges[1:], strict=True) if b > a])


def _merged(parts: list[tuple[str, int, int]]) -> list[tuple[str, int, int]]:
    """Short parts joined with the one before, or the first with the one after; the longer gives the name."""
    while len(parts) > 1:
        short = next((i for i, (_, a, b) in enumerate(parts) if b - a < LEAST_SAMPLES), None)
        if short is None:
            break
        i = max(short - 1, 0)
        pair = parts[i : i + 2]
        longer = max(pair, key=lambda part: part[2] - part[1])
        parts = [*parts[:i], (longer[0], pair[0][1], pair[1][2]), *parts[i + 2 :]]
    return parts


def phase_names(cells: Sequence[Cell]) -> list[str]:
    """Names of all phases, in an order that agrees with that of the trials where they agree."""
    names: list[str] = []
    at = 0
    trial = ""
    for cell in cells:
        at = at if cell.trial == trial else 0
        trial = cell.trial
        if cell.phase not in names:
            names.insert(at, cell.phase)
        at = names.index(cell.phase) + 1
    return names


def rms(cells: Sequence[Cell], values: Array) -> Array:
    """Root-mean-square in each cell, shape (cells, columns).

    Args:
        cells: all cells of `cut`.
        values: shape (samples, columns).
    """
    sizes, begins = _sizes(cells)
    total = np.add.reduceat(values**2, begins, axis=0)
    out: Array = np.sqrt(total / sizes[:, None])
    return out


def mean(cells: Sequence[Cell], values: Array) -> Array:
    """Mean in each cell, shape (cells, columns); see `rms`."""
    sizes, begins = _sizes(cells)
    out: Array = np.add.reduceat(values, begins, axis=0) / sizes[:, None]
    return out


def _sizes(cells: Sequence[Cell]) -> tuple[Array, npt.NDArray[np.intp]]:
    return np.array([c.end - c.begin for c in cells], dtype=np.float64), np.array([c.begin for c in cells])


def exceeding(time_s: Array, value_f0: Array, threshold_f0: float) -> tuple[float, float]:
    """First and last time at which a residual, smoothed over an eighth of the samples, exceeds a threshold, s.

    Where it nowhere does (a fast one, say), from where on and until when it is at least half of its largest.

    Args:
        time_s, value_f0: of one cell, shape (n,).
    """
    width = max(value_f0.size // 8, 1)
    counts = np.convolve(np.ones(value_f0.size), np.ones(width), "same")
    smooth = np.abs(np.convolve(value_f0, np.ones(width), "same") / counts)
    largest = float(smooth.max())
    where = np.flatnonzero(smooth >= (threshold_f0 if largest > threshold_f0 else 0.5 * largest))
    return float(time_s[where[0]]), float(time_s[where[-1]])
