"""Whether, where and when recording and fitted model differ by more than noise: a bootstrap that refits.

Samples of a residual resemble each other over tens of milliseconds, and a fit takes out of noise what its coordinates
can follow. So the null is made of noise of the recordings' own scale and autocorrelation, drawn with what is not known
of them, put through the fit's normal equations together with what its priors cost, and looked at in the same cells. The
largest over all cells counts (step-down maxima: Westfall and Young, Resampling-Based Multiple Testing (1993)), so that
the chance of any false cell is what a p-value says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.noise.cells import Cell, Residual, cut, exceeding, mean, phase_names, rms, slices
from xb_muscle_ros.diagnose.residual import Place, ResidualMap
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.trials.trial import Array

# A mismatch below this is of no use to anyone, F0, whatever its p-value, if it lasts so long; a shorter one has to be
# larger as the root of the time: a few milliseconds at the end of a fast ramp are the steps' and the sampling's.
FLOOR_F0, _FLOOR_S = 0.003, 0.1
_SIGMAS = 3.0
ALPHA = 0.01
"""Below this chance a difference is taken for one."""
# Numbers held at a time.
_AT_ONCE = 3_000_000
_LEAST_F0 = 1e-12
# With fewer cells than this none can be called quiet.
_FEW = 6


@dataclass(frozen=True)
class Significance:
    """The cells of a residual against noise that was fitted in the same way.

    Attributes:
        residuals, cells: what was looked at; arrays below go with `cells`.
        rms_f0, mean_f0: of measured minus simulated force, F0.
        p_value: chance that noise makes any cell stand out as much, so that all cells can be looked at together.
        floor_f0: a cell counts only above this: the practical floor or three standard deviations of its null.
        overall_rms_f0: over all samples of all trials.
        overall_null_f0: what noise reaches of that in 95 of 100 draws.
        overall_p: chance that noise makes some cell, or the whole, stand out as much.
    """

    residuals: tuple[Residual, ...]
    cells: tuple[Cell, ...]
    rms_f0: Array
    mean_f0: Array
    p_value: Array
    floor_f0: Array
    overall_rms_f0: float
    overall_null_f0: float
    overall_p: float
    practical_f0: float

    def counts(self, alpha: float = ALPHA) -> npt.NDArray[np.bool_]:
        """Cells that stand out and are large enough to matter, shape (cells,)."""
        found: npt.NDArray[np.bool_] = (self.p_value <= alpha) & (self.rms_f0 > self.floor_f0)
        return found

    def detected(self, alpha: float = ALPHA) -> bool:
        """Whether there is a mismatch: some cell counts, or the whole stands out and exceeds the practical floor."""
        whole = self.overall_p <= alpha and self.overall_rms_f0 > max(self.practical_f0, self.overall_null_f0)
        return whole or bool(np.any(self.counts(alpha)))

    def places(self, fibre: str, alpha: float = ALPHA) -> list[Place]:
        """Cells that count, of the phases with the largest residual first; where only the whole counts, the largest.

        The times of a cell that counts are those between which the smoothed residual exceeds its floor.
        """
        values = np.concatenate([r.value_f0 for r in self.residuals])
        times = np.concatenate([r.time_s for r in self.residuals])
        rows = []
        for i in np.flatnonzero(self.counts(alpha)):
            cell = self.cells[i]
            here = slice(cell.begin, cell.end)
            phase, size = self._phase(cell)
            span_s = exceeding(times[here], values[here], float(self.floor_f0[i]))
            rows.append((size, self._place(fibre, int(i), phase, *span_s)))
        if not rows and self.detected(alpha):
            i = int(np.argmax(self.rms_f0))
            cell = self.cells[i]
            return [self._place(fibre, i, cell.phase, cell.start_s, cell.end_s)]
        rows.sort(key=lambda row: (row[0], row[1].size_f0), reverse=True)
        return [place for _, place in rows]

    def _place(self, fibre: str, i: int, phase: str, start_s: float, end_s: float) -> Place:
        trial = self.cells[i].trial
        return Place(
            fibre, trial, phase, start_s, end_s, float(self.rms_f0[i]), float(self.mean_f0[i]), float(self.p_value[i]),
            pca=next(r.pca for r in self.residuals if r.trial == trial),
        )  # fmt: skip

    def _phase(self, cell: Cell) -> tuple[str, float]:
        """Name of the phase that a cell is part of, and the residual's root mean square over all of it, F0."""
        r = next(r for r in self.residuals if r.trial == cell.trial)
        times = r.time_s[(r.time_s >= cell.start_s) & (r.time_s <= cell.end_s)]
        # That of most of its samples: force may be absent in between.
        counts = [int(np.count_nonzero((times >= p.start_s) & (times <= p.end_s))) for p in r.phases]
        if not any(counts):
            return cell.phase, float(self.rms_f0[self.cells.index(cell)])
        phase = r.phases[int(np.argmax(counts))]
        inside = (r.time_s >= phase.start_s) & (r.time_s <= phase.end_s)
        return phase.name, float(np.sqrt(np.mean(r.value_f0[inside] ** 2)))

    def map(self) -> ResidualMap:
        """Trials by phases; None where a trial lacks a phase."""
        trials, phases = tuple(r.trial for r in self.residuals), tuple(phase_names(self.cells))
        places = [(trials.index(cell.trial), phases.index(cell.phase)) for cell in self.cells]

        def table(values: Array | npt.NDArray[np.bool_], absent: Any) -> tuple[tuple[Any, ...], ...]:
            rows = [[absent] * len(phases) for _ in trials]
            for (i, j), value in zip(places, values.tolist(), strict=True):
                rows[i][j] = value
            return tuple(map(tuple, rows))

        rms_f0, mean_f0, p_value = (table(of, None) for of in (self.rms_f0, self.mean_f0, self.p_value))
        return ResidualMap(trials, phases, rms_f0, mean_f0, p_value, table(self.counts(), False))


def significance(
    residuals: Sequence[Residual],
    fit: LinearFit,
    noise: NoiseModel,
    draws: int = 500,
    seed: int = 1,
    floor_f0: float = FLOOR_F0,
) -> Significance:
    """Compare a fit's residual with what it would be if there were only noise.

    Args:
        residuals: of all trials, after the fit.
        fit: its normal equations, samples in the order of the residuals.
        noise: of the trials; others may be among them.
        draws: of noise; no p-value is below 2/(draws + 1).

    Raises:
        UserError: residuals that cannot be looked at, samples that are not those of the fit, a trial of unknown noise.
    """
    cells = cut(residuals)
    values = np.concatenate([r.value_f0 for r in residuals])[:, None]
    sharp = sharpened(residuals, fit, noise)
    # The residual of a fit that knows that there is only noise.
    gained = sharp.slopes.T @ ((sharp.weights**2 - fit.weights**2)[:, None] * values)
    tested = values - sharp.slopes @ sharp.solved(gained)
    null, whole = [], []
    for drawn in null_residuals(residuals, sharp, noise, draws, seed):
        null.append(rms(cells, drawn))
        whole.append(np.sqrt(np.mean(drawn**2, axis=0)))
    of_cells, of_whole = np.concatenate(null, axis=1), np.concatenate(whole)
    found, overall = rms(cells, values)[:, 0], float(np.sqrt(np.mean(values**2)))
    size = np.append(rms(cells, tested)[:, 0], np.sqrt(np.mean(tested**2)))
    p = family_wise(size, np.vstack([of_cells, of_whole]))
    return Significance(
        residuals=tuple(residuals),
        cells=cells,
        rms_f0=found,
        mean_f0=mean(cells, values)[:, 0],
        p_value=p[:-1],
        floor_f0=np.maximum(_practical(cells, floor_f0), _SIGMAS * np.sqrt(np.mean(of_cells**2, axis=1))),
        overall_rms_f0=overall,
        overall_null_f0=float(np.quantile(of_whole, 0.95)),
        overall_p=float(p.min()),
        practical_f0=floor_f0,
    )


def _practical(cells: Sequence[Cell], floor_f0: float) -> Array:
    """The practical floor of each cell, F0."""
    lasting = np.array([max(cell.end_s - cell.start_s, 1e-3) for cell in cells])
    floors: Array = floor_f0 * np.sqrt(np.maximum(_FLOOR_S / lasting, 1.0))
    return floors


def null_residuals(
    residuals: Sequence[Residual], fit: LinearFit, noise: NoiseModel, draws: int, seed: int
) -> Iterator[Array]:
    """What the fit would leave if there were only noise, shapes (samples, some), `draws` columns in all, F0.

    Raises:
        UserError: see `significance`.
    """
    times_s = [r.time_s for r in residuals]
    samples = slices(residuals, fit.slopes.shape[0])[-1].stop
    if draws < 20:
        raise UserError(f"{draws} draws of noise; at least 20 are needed")
    chosen = noise.of([r.trial for r in residuals])
    random = np.random.default_rng(seed)
    for part in np.array_split(np.arange(draws), math.ceil(draws * samples / _AT_ONCE)):
        yield fit.residual(chosen.draw(times_s, part.size, random)) + fit.prior_residual(part.size, random)


def sharpened(residuals: Sequence[Residual], fit: LinearFit, noise: NoiseModel) -> LinearFit:
    """The fit with weights as the noise alone would have given them, where its own are lower.

    A mismatch makes a fit trust its data less, so that its priors pull more; they would not if there were only noise.

    Raises:
        UserError: see `significance`.
    """
    slices(residuals, fit.slopes.shape[0])
    variances = []
    for r, of_trial in zip(residuals, noise.of([r.trial for r in residuals]).trials, strict=True):
        # Integrated autocorrelation time: so many samples are worth one independent one.
        counted = of_trial.likeliest.variance_of_mean(r.time_s)
        variances.append(np.full(r.time_s.size, max(counted, of_trial.sd_f0**2)))
    weighted = fit.weights**2 * np.concatenate(variances)
    used = weighted[fit.weights > 0.0]
    factor = 1.0 / math.sqrt(float(np.mean(used))) if used.size else 1.0
    return replace(fit, weights=fit.weights * max(factor, 1.0))


def family_wise(found: Array, null: Array) -> Array:
    """P-values of the sizes in cells and, last, of the whole, shape (cells + 1,).

    Sizes as they are tell of a mismatch that is everywhere; sizes against that of the quieter cells of the same draw
    tell of one that is somewhere, however little is known of the size of noise. Each p-value is twice the lesser.

    Args:
        found: shape (cells + 1,), F0.
        null: shape (cells + 1, draws), F0.
    """
    log_null, log_found = np.log(np.maximum(null, _LEAST_F0)), np.log(np.maximum(found, _LEAST_F0))
    plain = step_down(log_found, log_null)
    if found.size < _FEW:
        return plain
    centre = np.mean(log_null, axis=1)
    quiet_null = np.quantile(log_null[:-1] - centre[:-1, None], 0.25, axis=0)
    quiet = float(np.quantile(log_found[:-1] - centre[:-1], 0.25))
    p: Array = np.minimum(2.0 * np.minimum(plain, step_down(log_found - quiet, log_null - quiet_null)), 1.0)
    return p


def step_down(found: Array, null: Array) -> Array:
    """Family-wise p-values, shape (n,).

    Compared in standard deviations of each one's own null, so that a noisy cell does not hide the others.

    Args:
        found: shape (n,), any size that grows with the mismatch.
        null: shape (n, draws).
    """
    centre, sd = np.mean(null, axis=1), np.maximum(np.std(null, axis=1), 1e-6)
    drawn = (null - centre[:, None]) / sd[:, None]
    size = (found - centre) / sd
    order = np.argsort(-size)
    # The largest of those that have not stood out more.
    largest = np.maximum.accumulate(drawn[order][::-1], axis=0)[::-1]
    p = (1.0 + np.count_nonzero(largest >= size[order][:, None], axis=1)) / (1.0 + null.shape[1])
    out = np.empty(found.size)
    out[order] = np.maximum.accumulate(p)
    return out
