"""Whether parts of a study want parameters that conflict: what each would gain by having its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.cells import Residual
from xb_muscle_ros.diagnose.linear_fit import LinearFit
from xb_muscle_ros.diagnose.noise.model import NoiseModel
from xb_muscle_ros.diagnose.significance import null_residuals, sharpened
from xb_muscle_ros.errors import UserError

Array = npt.NDArray[np.float64]

_LEAST_F0 = 1e-12


class Conflict(NamedTuple):
    """One part of a study against the rest.

    Attributes:
        group: name of the part.
        gain_f0: root-mean-square force by which its residual would change if it had its own coordinates, F0.
        p_value: chance that noise makes any part gain as much.
        moves: how far each coordinate would go for this part, in its moved scale, shape (coordinates,).
    """

    group: str
    gain_f0: float
    p_value: float
    moves: Array


def conflicts(
    residuals: Sequence[Residual],
    groups: Sequence[str],
    fit: LinearFit,
    noise: NoiseModel,
    draws: int = 300,
    seed: int = 1,
) -> list[Conflict]:
    """Each part's gain, to first order, against that from noise put through the same fit; largest gain first.

    Args:
        residuals: of all trials, after the fit of all.
        groups: name of the part that each trial belongs to (its protocol, pCa, ...).
        fit: its normal equations, samples in the order of the residuals.
        noise, draws, seed: see `significance.significance`.

    Raises:
        UserError: fewer than two parts, marks that do not belong to the trials, and what `significance` raises.
    """
    names = list(dict.fromkeys(groups))
    if len(groups) != len(residuals) or len(names) < 2:
        raise UserError(
            f"{len(names)} parts for {len(residuals)} trials ({len(groups)} marks); needed are two and one mark each"
        )
    sharp = sharpened(residuals, fit, noise)
    of_sample = np.repeat(groups, [r.time_s.size for r in residuals])
    parts = [_Part(sharp, of_sample == name) for name in names]
    values = np.concatenate([r.value_f0 for r in residuals])[:, None]
    drawn = [[part.gain(x) for part in parts] for x in null_residuals(residuals, sharp, noise, draws, seed)]
    null = np.log(np.maximum(np.concatenate(drawn, axis=1), _LEAST_F0))
    gains = np.array([part.gain(values)[0] for part in parts])
    centre, sd = np.mean(null, axis=1, keepdims=True), np.maximum(np.std(null, axis=1, keepdims=True), 1e-6)
    largest = np.max((null - centre) / sd, axis=0)
    size = (np.log(np.maximum(gains, _LEAST_F0)) - centre[:, 0]) / sd[:, 0]
    p = (1.0 + np.count_nonzero(largest >= size[:, None], axis=1)) / (1.0 + largest.size)
    found = [
        Conflict(name, float(gain), float(q), part.moves(values)[:, 0])
        for name, gain, q, part in zip(names, gains, p, parts, strict=True)
    ]
    return sorted(found, key=lambda row: -row.gain_f0)


class _Part:
    """Samples of one part, fitted by themselves from where the fit of all ended."""

    def __init__(self, fit: LinearFit, which: npt.NDArray[np.bool_]) -> None:
        self.which = which
        self.fit = LinearFit(fit.slopes[which], fit.weights[which], fit.prior)

    def moves(self, values: Array) -> Array:
        """Of the coordinates, shape (coordinates, columns)."""
        return self.fit.moved(values[self.which])

    def gain(self, values: Array) -> Array:
        """Root-mean-square change of the residual, shape (columns,)."""
        out: Array = np.sqrt(np.mean((self.fit.slopes @ self.moves(values)) ** 2, axis=0))
        return out
