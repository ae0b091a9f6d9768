"""What a fit does to a small change of the data, to first order: how far its coordinates move, and what is left."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

# Directions of less than this share of the largest curvature, in units of each coordinate's own, are not seen.
_UNSEEN = 1e-9


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

    @cached_property
    def information(self) -> Array:
        """Of the priors, shape (coordinates, coordinates)."""
        return np.diag(self.prior) if self.prior.ndim == 1 else self.prior

    @cached_property
    def score(self) -> Array:
        """How a sample bears on the gradient of the cost, shape (samples, coordinates)."""
        return self.slopes * (self.weights**2)[:, None]

    @cached_property
    def _seen(self) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Root of the inverse of the curvature, its directions, and which of them data or priors see."""
        curvature = self.slopes.T @ self.score + self.information
        # In units of each coordinate's own curvature, so that the inverse does not depend on units.
        unit = np.sqrt(np.maximum(np.diag(curvature), 1e-12))
        values, vectors = np.linalg.eigh(curvature / unit / unit[:, None])
        seen = values > _UNSEEN * np.max(values, initial=0.0)
        root = vectors / np.sqrt(np.where(seen, values, np.inf)) / unit[:, None]
        return root, vectors, seen

    @cached_property
    def inverse(self) -> Array:
        """Inverse of the curvature where it is seen: the covariance, had every weight its sample's own noise."""
        root, _, _ = self._seen
        return root @ root.T

    @property
    def weak(self) -> npt.NDArray[np.bool_]:
        """Coordinates whose direction the data hardly see, shape (coordinates,)."""
        _, vectors, seen = self._seen
        out: npt.NDArray[np.bool_] = np.sqrt(np.sum(vectors[:, ~seen] ** 2, axis=1)) > 0.1
        return out

    def moved(self, change: Array) -> Array:
        """How far the coordinates move with a change of the data, shape (coordinates, columns).

        Args:
            change: shape (samples, columns), F0.
        """
        return self.solved(self.score.T @ change)

    def solved(self, score: Array) -> Array:
        """Coordinates that meet a score, shape (coordinates, columns) both."""
        return self.inverse @ score

    def residual(self, change: Array) -> Array:
        """What a change of the data leaves after the refit, shape (samples, columns)."""
        return change - self.slopes @ self.moved(change)

    def prior_residual(self, draws: int, random: np.random.Generator) -> Array:
        """Residuals that the priors cause when the truth lies where they expect it, shape (samples, draws)."""
        values, vectors = np.linalg.eigh(self.information)
        known = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
        # Information times a deviation of that covariance.
        root = vectors[:, known] * np.sqrt(values[known])
        score = root @ random.standard_normal((int(np.count_nonzero(known)), draws))
        return self.slopes @ self.solved(score)
