"""What a method adds to the forces of the Gaussian form, to first order around a point.

A strain grid costs a hundred times what the Gaussian form costs, and close to a point the two differ by little that
bends. Least squares over the Gaussian form with this difference added have the grid's values and slopes at the point;
moved to where they lead, again and again, they end at the grid's own best point (first-order model management,
Alexandrov and Lewis, Optimization and Engineering 2 (2001) 413-430).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.trials.trial import Array


@dataclass(frozen=True)
class Correction:
    """Difference between two methods at a point and how it changes from there.

    Attributes:
        at: the point, on the moved scale, shape (coordinates,); empty where there are no slopes.
        force: difference of the fibre's force at a trial's samples by the trial's name, F0, shape (samples,).
        force_slopes: its derivatives by the coordinates, shape (samples, coordinates); none of trials that are
            corrected alike at every point.
        features: difference of each training feature in its standard deviations, shape (features,).
        feature_slopes: its derivatives, shape (features, coordinates).
    """

    at: Array
    force: Mapping[str, Array]
    force_slopes: Mapping[str, Array]
    features: Array
    feature_slopes: Array

    @staticmethod
    def level(force: Mapping[str, Array], features: Array) -> Correction:
        """A correction that is the same at every point, whatever the coordinates: without slopes."""
        return Correction(np.empty(0), force, {}, features, np.empty((features.size, 0)))

    def of_trial(self, name: str, z: Array) -> Array:
        """What to add to the fibre's force in a trial at a point, F0, before the recording's faults.

        Raises:
            KeyError: the trial has no correction; held-out ones have none.
        """
        slopes = self.force_slopes.get(name)
        return self.force[name] if slopes is None else self.force[name] + slopes @ (z - self.at)

    def of_features(self, z: Array) -> Array:
        """What to add to the distances of the training features at a point, in standard deviations."""
        return self.features + (self.feature_slopes @ (z - self.at) if self.feature_slopes.size else 0.0)
