"""What a fit does to a small change of the data, to first order: how far its coordinates go along, and what is left."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

from xb_muscle_ros.errors import UserError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class LinearFit:
    """A fit's normal equations at its best point; samples of all trials one below the other.

    Coordinates at a bound do not move: leave them out.

    Attributes:
        slopes: of the model's recorded force by the coordinates, shape (samples, coordinates), F0 (0 coordinates: a
            model that nothing was fitted of).
        weights: one over the standard deviation that the fit gave a sample's difference, shape (samples,); 0 where
            a sample was held out.
        prior: information of the priors, and of features that were fitted beside the force, shape (coordinates,)
            for a diagonal or (coordinates, coordinates).

    Raises:
        UserError: shapes that do not belong together, or values that are not finite.
    """

    slopes: Array
    weights: Array
    prior: Array

    def __post_init__(self) -> None:
        n, p = self.slopes.shape
        if self.weights.shape != (n,) or self.prior.shape not in ((p,), (p, p)):
            raise UserError(
                f"slopes of shape {self.slopes.shape} with weights {self.weights.shape} and prior {self.prior.shape}; "
                f"needed are ({n},) and ({p},) or ({p}, {p})"
            )
        for name in ("slopes", "weights", "prior"):
            if not np.all(np.isfinite(getattr(self, name))):
                raise UserError(f"{name} of the fit are not finite; leave the coordinate or trial at fault out")

    @staticmethod
    def nothing(samples: int) -> LinearFit:
        """A model that was not fitted."""
        return LinearFit(np.zeros((samples, 0)), np.ones(samples), np.zeros(0))

    @cached_property
    def information(self) -> Array:
        """Of the priors, shape (coordinates, coordinates)."""
        return np.diag(self.prior) if self.prior.ndim == 1 else self.prior

    @cached_property
    def _weighted(self) -> Array:
        out: Array = self.slopes * (self.weights**2)[:, None]
        return out

    @cached_property
    def _factor(self) -> tuple[tuple[Array, bool], Array]:
        """Cholesky factor of the curvature, scaled to a unit diagonal, and the scale."""
        curvature = self.slopes.T @ self._weighted + self.information
        scale = 1.0 / np.sqrt(np.maximum(np.diag(curvature), 1e-300))
        scaled = curvature * scale * scale[:, None]
        # Coordinates that the data cannot tell apart share what they do.
        return cho_factor(scaled + 1e-10 * np.eye(scale.size)), scale

    def moved(self, change: Array) -> Array:
        """How far the coordinates go along with a change of the data, shape (coordinates, columns).

        Args:
            change: shape (samples, columns), F0.
        """
        if not self.slopes.shape[1]:
            return np.zeros((0, change.shape[1]))
        return self.solved(self._weighted.T @ change)

    def solved(self, score: Array) -> Array:
        """Coordinates that meet a score, shape (coordinates, columns) both."""
        if not score.shape[0]:
            return score
        factor, scale = self._factor
        found: Array = scale[:, None] * cho_solve(factor, scale[:, None] * score)
        return found

    def left(self, change: Array) -> Array:
        """What a change of the data leaves in the residual after the refit, shape (samples, columns)."""
        out: Array = change - self.slopes @ self.moved(change)
        return out

    def pulled(self, draws: int, random: np.random.Generator) -> Array:
        """Residuals that the priors cause when the truth lies where they expect it, shape (samples, draws)."""
        values, vectors = np.linalg.eigh(self.information)
        known = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
        # Information times a deviation of that covariance.
        root = vectors[:, known] * np.sqrt(values[known])
        score = root @ random.standard_normal((int(np.count_nonzero(known)), draws))
        out: Array = self.slopes @ self.solved(score)
        return out
