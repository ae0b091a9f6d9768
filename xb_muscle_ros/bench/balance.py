"""Whether a muscle's forces balance: heads against the series spring, whose law is integrated here once more."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.special import roots_legendre

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre

Array = npt.NDArray[np.float64]


class Balance:
    """The series spring's law in a table of its own, to hold a model's outputs against.

    The spring bears F = Fscale·F_xb with dF_xb/dl = kse (F_xb + kse0), F_xb smoothed at 0 as the fibre's set says; what
    it is stretched by is the fibre's length less the contractile element's. Both come from the node's messages.
    """

    def __init__(self, fibre: Fibre) -> None:
        """Integrate the law numerically.

        Raises:
            UserError: the model has no cross-bridges on an exponential spring.
        """
        missing = {"kse", "kse0", "gamma", "Fscale", "koop"} - set(fibre.values)
        if missing:
            raise UserError(f"model {fibre.model} has no heads on a series spring to balance; take 3state_coop")
        self._v = fibre.values
        self._force = np.linspace(-1.0, 4.0, 50_001)
        nodes, weights = roots_legendre(8)
        half = 0.5 * (self._force[1] - self._force[0])
        middle = 0.5 * (self._force[1:] + self._force[:-1])
        panels = half * np.sum(weights / self._stiffness(middle[:, None] + half * nodes), axis=1)
        length = np.concatenate([[0.0], np.cumsum(panels)])
        self._length = length - length[np.searchsorted(self._force, 0.0)]

    def _stiffness(self, force: Array) -> Array:
        """Slope of the spring, dF_xb per power stroke."""
        sharp = self._v["smoothing"]
        taut = np.maximum(force, 0.0) if sharp == 0.0 else np.logaddexp(0.0, sharp * force) / sharp
        slope: Array = self._v["kse"] * (taut + self._v["kse0"])
        return slope

    def error_f0(self, q0: Array, q1: Array, length_change_l0: Array, ce_length_change_l0: Array) -> Array:
        """Difference between the heads' force and the spring's, F0; NaN where the force is beyond -1 to 4."""
        heads = q0 + q1
        spring = CubicHermiteSpline(self._force, self._length, 1.0 / self._stiffness(self._force), extrapolate=False)
        stretch = self._v["gamma"] * (length_change_l0 - ce_length_change_l0)
        error: Array = self._v["Fscale"] * self._stiffness(heads) * (spring(heads) - stretch)
        return error
