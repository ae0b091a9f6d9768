"""Isometric force of many fibres at their lengths: what the blocks of force and length say, for arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.mechanisms import Quantities
from xb_muscle_ros.mechanisms.extras.active_force_length import ActiveForceLength
from xb_muscle_ros.mechanisms.extras.passive_force_length import PassiveForceLength
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.plant.mjcf.spring import spring_of
from xb_muscle_ros.plant.plant import Array

_PARAMETERS = ("fl_min", "fl_max", "fl_optimum", "fp_max", "fp_onset")
_HALVINGS = 60
_MOST_F0 = 50.0


@dataclass(frozen=True, eq=False)
class Relations:
    """Force and length of fibres at rest; arrays have shape (fibre,) or shapes that go with each other.

    A fibre's length is that of its half-sarcomeres and of its series element, and all bear the same force.

    Attributes:
        fl_min, fl_max, fl_optimum, fp_max, fp_onset: see `ActiveForceLength` and `PassiveForceLength`.
        series_l0, series_f0: of the series element, see `Spring`.
    """

    fl_min: Array
    fl_max: Array
    fl_optimum: Array
    fp_max: Array
    fp_onset: Array
    series_l0: Array
    series_f0: Array

    def active(self, sarcomere_change: Array) -> Array:
        """Share of the heads' force at a length change of the half-sarcomeres in L0."""
        share: Array = ActiveForceLength().force_share(self._quantities(sarcomere_change))[0]
        return share

    def passive_f0(self, sarcomere_change: Array) -> Array:
        """Passive force at a length change of the half-sarcomeres in L0."""
        force: Array = PassiveForceLength().inner_force(self._quantities(sarcomere_change))
        return force

    def extension_l0(self, force_f0: Array) -> Array:
        """Extension of the series element, L0."""
        extension: Array = self.series_l0 * np.log1p(force_f0 / self.series_f0)
        return extension

    def force_f0(self, length_change_l0: Array, activation: Array) -> Array:
        """Isometric force at a length change of the fibres, by halving the force that is left possible.

        Args:
            length_change_l0: from the optimum, L0.
            activation: isometric force at the optimal length, F0.
        """
        length, activation = np.broadcast_arrays(length_change_l0, activation)
        low, high = np.zeros(length.shape), np.full(length.shape, _MOST_F0)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            change = length - self.extension_l0(middle)
            # A taut series element leaves half-sarcomeres shorter, where they pull less on the ascending limb.
            more = activation * self.active(change) + self.passive_f0(change) > middle
            low, high = np.where(more, middle, low), np.where(more, high, middle)
        force: Array = (low + high) / 2.0
        return force

    def _quantities(self, sarcomere_change: Array) -> Quantities:
        values = {name: getattr(self, name) for name in _PARAMETERS}
        # Forces are in F0 here, so that cross-bridge force needs no scale.
        return Quantities({**values, "sarcomere_change": sarcomere_change, "Fscale": 1.0}, "relations", None)


def relations_of(fibres: Sequence[Fibre]) -> Relations:
    """The relations of fibres whose models have both force-length mechanisms."""
    rows = [(*(fibre.values[name] for name in _PARAMETERS), *spring_of(fibre)) for fibre in fibres]
    return Relations(*np.array(rows).T)
