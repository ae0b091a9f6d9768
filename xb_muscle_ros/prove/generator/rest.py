"""What a model that lacks one thing leaves, once everything else has been fitted again to first order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import cho_factor, cho_solve

Array = npt.NDArray[np.float64]

# Ten independent observations of 0.3 % F0 a trial, against priors of SD 1 on every coordinate.
WORTH, WORTH_SD = 10.0, 0.003


class Taken(NamedTuple):
    """A linear fit.

    Attributes:
        left: what it leaves, F0, shape (samples,).
        pulled: how far each coordinate went, in SDs of its prior, shape (coordinates,).
    """

    left: Array
    pulled: Array

    @property
    def rms(self) -> float:
        """Of what is left, F0."""
        return float(np.sqrt(np.mean(self.left**2)))


class Rest:
    """All that may change to take up a difference: constants, other effects' scales, ordinary errors of measurement."""

    def __init__(self, columns: Sequence[Array] | Array, trials: int) -> None:
        """Take the change of all forces by one prior SD of each coordinate.

        Args:
            columns: each of shape (samples of all trials,), F0; or a matrix of them.
            trials: how many there are.
        """
        self._columns = np.column_stack(list(columns)) if not isinstance(columns, np.ndarray) else columns
        self._weight = np.sqrt(WORTH * trials / self._columns.shape[0]) / WORTH_SD

    def without(self, i: int) -> Rest:
        """The same but for one coordinate."""
        made = Rest.__new__(Rest)
        made._columns, made._weight = np.delete(self._columns, i, axis=1), self._weight
        return made

    def take(self, difference: Array) -> Taken:
        """Penalised least squares of data minus model, F0, shape (samples,); NaN where these are not finite."""
        if not (np.all(np.isfinite(difference)) and np.all(np.isfinite(self._columns))):
            return Taken(np.full(difference.size, np.nan), np.full(self._columns.shape[1], np.nan))
        a = self._weight * self._columns
        factor = cho_factor(a.T @ a + np.eye(a.shape[1]))
        pulled: Array = cho_solve(factor, self._weight * (a.T @ difference))
        return Taken(difference - self._columns @ pulled, pulled)
