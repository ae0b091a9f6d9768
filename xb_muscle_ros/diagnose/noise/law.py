"""The law of a residual: its response to length changes and what it grows with, even where no mechanism fits.

Exponential responses to velocity, x' = v - x/τ (a Prony series), are what viscoelastic, cross-bridge and
calcium-dependent elements have in common to first order; a drag is a short one, a spring a long one. What the fit's
coordinates could have taken is taken out of each before it is compared with the residual.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from xb_muscle_ros.diagnose.noise.cells import Residual, check, slices
from xb_muscle_ros.diagnose.residual import ResidualLaw
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.scores.noise.members import recursion
from xb_muscle_ros.trials.trial import Array

TAU_S = np.geomspace(0.002, 5.0, 18)
CONSTANT = "constant"
# Ridge on the weights against that of data: keeps responses that the fit nearly took out from growing without bound.
_RIDGE = 1e-4
# Time constants within this factor of the largest one's are one law.
_NEAR = 4.0
_LEAST_F0 = 1e-9


def exponential_basis(time_s: Array, change_l0: Array, tau_s: Array) -> Array:
    """Responses x' = v - x/τ from rest at the first sample, exact for length that is straight between samples.

    Args:
        time_s: shape (n,), s.
        change_l0: of length from sample to sample, shape (n - 1,), L0.
        tau_s: shape (k,), s.

    Returns:
        Shape (n, k), L0.
    """
    dt = np.diff(time_s)[:, None]
    given = change_l0[:, None] / dt * tau_s * -np.expm1(-dt / tau_s)
    return recursion(time_s, np.concatenate([np.zeros((1, tau_s.size)), given]), tau_s)


def law(
    fibre: str, residuals: Sequence[Residual], fit: LinearFit, scalings: Mapping[str, Sequence[Array]]
) -> ResidualLaw | None:
    """The law of a fit's residual; None where no response predicts anything of a trial left out.

    Non-negative least squares over all time constants at once, with either sign, for each thing that the law may
    scale with; the best in cross-validation over trials counts.

    Args:
        residuals: of all trials, after the fit.
        fit: its normal equations, samples in the order of the residuals.
        scalings: by name, for each trial: activation, calcium (0 to 1, saturating), force ... at the residual's times.

    Raises:
        UserError: residuals, samples or scalings that do not belong together.
    """
    known = scales(residuals, fit, scalings)
    target = np.concatenate([r.value_f0 for r in residuals])
    if float(np.sqrt(np.mean(target**2))) < _LEAST_F0:
        return None
    plain = np.concatenate([exponential_basis(r.time_s, np.diff(r.length_l0), TAU_S) for r in residuals])
    best: tuple[float, str, int, Array, Array] | None = None
    shares: dict[str, float] = {}
    for name, scale in known.items():
        columns = plain * scale[:, None]
        sizes = np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
        products = _Products(fit.residual(columns / sizes), target, slices(residuals, target.size))
        for sign in (1, -1):
            share = products.explained(sign)
            shares[name] = max(share, shares.get(name, -math.inf))
            if best is None or share > best[0]:
                best = (share, name, sign, products.weights(sign, None), sizes)
    if best is None or best[0] <= 0.0 or not np.any(best[3] > 0.0):
        return None
    share, name, sign, weights, sizes = best
    top = float(TAU_S[int(np.argmax(weights))])
    near = np.abs(np.log(TAU_S / top)) <= math.log(_NEAR)
    return ResidualLaw(
        fibre=fibre,
        time_constant_s=float(np.exp(np.average(np.log(TAU_S[near]), weights=weights[near]))),
        scales_with=name,
        gain_f0_per_l0=float(np.sum(sign * weights / sizes)),
        explained_fraction=share,
        tau_s=tuple(TAU_S.tolist()),
        weight_f0=tuple((sign * weights).tolist()),
        other_scalings={other: value for other, value in shares.items() if other != name},
    )


class _Products:
    """Products of columns and of columns with the target, trial by trial: all that least squares needs."""

    def __init__(self, columns: Array, target: Array, parts: list[slice]) -> None:
        self.columns, self.target, self.parts = columns, target, parts
        self.gram = np.array([columns[s].T @ columns[s] for s in self.parts])
        self.across = np.array([columns[s].T @ target[s] for s in self.parts])
        # In units of columns before the fit took its part: a response that it took stays small.
        self.ridge = _RIDGE * target.size * np.eye(columns.shape[1])

    def weights(self, sign: int, without: int | None) -> Array:
        """Not negative, from all trials but one, shape (columns,)."""
        chosen = [i for i in range(len(self.parts)) if i != without]
        root = cholesky(self.gram[chosen].sum(axis=0) + self.ridge, lower=True)
        found: Array = nnls(root.T, sign * solve_triangular(root, self.across[chosen].sum(axis=0), lower=True))[0]
        return found

    def explained(self, sign: int) -> float:
        """Share of the mean square that weights from the other trials explain (with one trial: its own)."""
        single = len(self.parts) == 1
        missed = 0.0
        for i, part in enumerate(self.parts):
            predicted = self.columns[part] @ (sign * self.weights(sign, None if single else i))
            missed += float(np.sum((self.target[part] - predicted) ** 2))
        return 1.0 - missed / float(self.target @ self.target)


def scales(residuals: Sequence[Residual], fit: LinearFit, scalings: Mapping[str, Sequence[Array]]) -> dict[str, Array]:
    """What a law may scale with, all trials one below the other, the constant first."""
    check(residuals)
    sizes = [r.time_s.size for r in residuals]
    slices(residuals, fit.slopes.shape[0])
    out = {CONSTANT: np.ones(sum(sizes))}
    for name, arrays in scalings.items():
        if [a.size for a in arrays] != sizes:
            found = [a.size for a in arrays]
            raise UserError(f"scaling '{name}' has {found} samples, the residuals {sizes}; give the same")
        out[name] = np.concatenate([np.asarray(a, dtype=np.float64) for a in arrays])
        if not np.all(np.isfinite(out[name])):
            raise UserError(f"scaling '{name}' is not finite; leave it out")
    return out
