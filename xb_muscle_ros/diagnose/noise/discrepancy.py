"""Non-parametric discrepancy: what predicts a held-out trial's residual without physics, the benchmark of a mechanism.

Ridge regression on a dictionary: exponential responses to stretch and to shortening, time constants from 2 ms to 5 s,
and length itself, each scaled by nothing, activation, calcium or force. How much of the dictionary is used, and how
freely, is chosen by cross-validation over the training trials; where it does not help them, nothing is predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.noise.cells import Residual, slices
from xb_muscle_ros.diagnose.noise.law import exponential_basis, scales
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.trials.trial import Array

_TAU_S = np.geomspace(0.002, 5.0, 8)
# Against the mean square of a column before the fit took its part.
_RIDGES = np.geomspace(1e-5, 1.0, 11)
# A smaller share of the mean square is not worth predicting.
_LEAST_SHARE = 0.05


class Discrepancy(NamedTuple):
    """A discrepancy that knows no physics.

    Attributes:
        predicted_f0: predicted residual of each held-out trial, in their order, F0.
        explained: share of the training residual's mean square that was predicted of trials left out.
    """

    predicted_f0: tuple[Array, ...]
    explained: float


def discrepancy(
    residuals: Sequence[Residual], held_out: Sequence[bool], fit: LinearFit, scalings: Mapping[str, Sequence[Array]]
) -> Discrepancy:
    """Predict the residual of held-out trials from that of the training trials.

    Args:
        residuals: of all trials, under the coordinates that were fitted to the training trials.
        held_out: for each trial.
        fit: the fit's normal equations, samples in the order of the residuals, weights 0 where held out: what the
            training trials made the coordinates take is taken out of the held-out ones.
        scalings: by name, for each trial, at the residual's times; see `law.law`.

    Raises:
        UserError: inputs that do not belong together, no training trial, or weights on held-out samples.
    """
    known = scales(residuals, fit, scalings)
    if len(held_out) != len(residuals):
        raise UserError(f"{len(held_out)} marks of held-out trials for {len(residuals)} trials; give one each")
    parts = slices(residuals, fit.slopes.shape[0])
    train = [part for part, out in zip(parts, held_out, strict=True) if not out]
    held = [part for part, out in zip(parts, held_out, strict=True) if out]
    if not train:
        raise UserError(f"all {len(residuals)} trials are held out; leave at least one to learn from")
    if any(np.any(fit.weights[part] != 0.0) for part in held):
        raise UserError("the fit has weight on held-out samples; give those 0")
    target = np.concatenate([r.value_f0 for r in residuals])
    plain = np.concatenate([_terms(r) for r in residuals])
    columns, owner = [], []
    for name, scale in known.items():
        own = np.column_stack([plain, np.ones(target.size)]) * scale[:, None]
        size = np.sqrt(np.mean(np.concatenate([own[part] for part in train]) ** 2, axis=0))
        # Lengths that never changed in training say nothing.
        own = own[:, size > 1e-12] / size[size > 1e-12]
        columns.append(own)
        owner += [name] * own.shape[1]
    return _chosen(fit.residual(np.column_stack(columns)), np.array(owner), target, train, held)


def _terms(r: Residual) -> Array:
    """Responses to stretch and to shortening, length and its square; shape (n, terms)."""
    change = np.diff(r.length_l0)
    length = r.length_l0 - r.length_l0[0]
    stretch = exponential_basis(r.time_s, np.maximum(change, 0.0), _TAU_S)
    shortening = exponential_basis(r.time_s, np.minimum(change, 0.0), _TAU_S)
    return np.column_stack([stretch, shortening, length, length**2])


def _chosen(
    columns: Array, owner: npt.NDArray[np.str_], target: Array, train: list[slice], held: list[slice]
) -> Discrepancy:
    """The dictionary and ridge that predict most of training trials left out, and their predictions of held-out."""
    gram = np.array([columns[part].T @ columns[part] for part in train])
    across = np.array([columns[part].T @ target[part] for part in train])
    samples = np.array([part.stop - part.start for part in train])
    silent = np.array([float(target[part] @ target[part]) for part in train])
    names = list(dict.fromkeys(owner.tolist()))
    best: tuple[float, tuple[str, ...], float] = (0.0, (), 0.0)
    for chosen in [*((name,) for name in names), *([tuple(names)] if len(names) > 1 else [])]:
        which = np.flatnonzero(np.isin(owner, chosen))
        missed = _missed(gram[:, which][:, :, which], across[:, which], silent, samples)
        gain = silent - missed
        total = gain.sum(axis=1)
        k = int(np.argmax(total))
        if total[k] > max(best[0], _LEAST_SHARE * silent.sum()) and not _luck(gain[k], silent):
            best = (float(total[k]), tuple(chosen), float(_RIDGES[k]))
    if not best[1]:
        return Discrepancy(tuple(np.zeros(part.stop - part.start) for part in held), 0.0)
    which = np.flatnonzero(np.isin(owner, best[1]))
    weights = _ridge(gram.sum(axis=0)[which][:, which], across.sum(axis=0)[which], best[2] * samples.sum())
    predicted = tuple(columns[part][:, which] @ weights for part in held)
    return Discrepancy(predicted, best[0] / float(silent.sum()))


def _luck(gain: Array, silent: Array) -> bool:
    """Whether a gain may be one trial's: below its standard error over trials, or, as a share of each, below twice."""
    if gain.size < 2:
        return True
    share = gain / np.maximum(silent, 1e-300)
    error, of_share = (float(np.std(x, ddof=1)) * np.sqrt(gain.size) for x in (gain, share))
    return bool(float(gain.sum()) < error or float(share.sum()) < 2.0 * of_share)


def _missed(gram: Array, across: Array, silent: Array, samples: npt.NDArray[np.int64]) -> Array:
    """Sum of squares missed of each trial by the others' weights, shape (ridges, trials)."""
    out = np.empty((_RIDGES.size, silent.size))
    for i in range(silent.size):
        others = [j for j in range(silent.size) if j != i]
        if not others:
            return np.broadcast_to(silent, out.shape)
        for k, ridge in enumerate(_RIDGES):
            w = _ridge(gram[others].sum(axis=0), across[others].sum(axis=0), ridge * float(samples[others].sum()))
            out[k, i] = silent[i] - 2.0 * w @ across[i] + w @ gram[i] @ w
    return out


def _ridge(gram: Array, across: Array, ridge: float) -> Array:
    weights: Array = np.linalg.solve(gram + ridge * np.eye(across.size), across)
    return weights
