"""The fit's problem: from a point to the difference between model and measurement, and its slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from xb_muscle_ros.errors import naming
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.features import Feature
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, Scope
from xb_muscle_ros.measurement.recording import given_calcium, given_length, recorded_force
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.plain import fibre_from_plain, fibre_to_plain
from xb_muscle_ros.simulation.offline import outputs
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work.plain import from_plain, to_plain


@dataclass(frozen=True)
class Problem:
    """Trials of one fibre and what may be moved to meet them.

    Attributes:
        fibre: start values, model, method.
        trials: training and held-out ones.
        coordinates: what is moved.
        ties: parameter -> parameter whose value it takes.
        features: numbers to meet beside the traces; training and held-out ones.
        correction: what is added to the model's forces and features, or None.
    """

    fibre: Fibre
    trials: tuple[FitTrial, ...]
    coordinates: tuple[Coordinate, ...]
    ties: Mapping[str, str]
    features: tuple[Feature, ...] = ()
    correction: Correction | None = None
    _places: dict[tuple[str, str], tuple[tuple[str, int], ...]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def start(self) -> Array:
        """Start of all coordinates on the moved scale."""
        return np.array([c.inward(c.start) for c in self.coordinates])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds on the moved scale."""
        lower = np.array([c.inward(c.lower) for c in self.coordinates])
        return lower, np.array([c.inward(c.upper) for c in self.coordinates])

    def fibre_at(self, z: Array) -> Fibre:
        """The fibre with the parameters of a point."""
        values = dict(self.fibre.values)
        for c, moved in zip(self.coordinates, z, strict=True):
            if c.group is None:
                values[c.name] = c.outward(float(moved))
        for tied, source in self.ties.items():
            values[tied] = values[source]
        return replace(self.fibre, values=MappingProxyType(values))

    def faults_at(self, z: Array, trial: FitTrial) -> dict[str, float]:
        """Faults of a trial at a point; those of a solution or trial that was not fitted are 0."""
        return {name: float(z[j]) for name, j in self._faults_of(trial.name, trial.solution)}

    def _faults_of(self, trial: str, solution: str) -> tuple[tuple[str, int], ...]:
        """Names and places of the faults that bear on a trial; asked for at every point of a fit, so remembered."""
        key = (trial, solution)
        if key not in self._places:
            named = [(j, c) for j, c in enumerate(self.coordinates) if c.group is not None]
            self._places[key] = tuple((c.name, j) for j, c in named if _bears_on(c, trial, solution))
        return self._places[key]

    def true_forces(self, muscle: Muscle, z: Array, trials: Sequence[FitTrial]) -> list[Array]:
        """The fibre's force at the samples of trials, F0, before the recording's faults.

        Raises:
            UserError: see `Muscle.settle` and `Muscle.run`; begins with the trial's name.
        """
        settled: dict[tuple[float, float], Array] = {}
        found = []
        for trial in trials:
            faults = self.faults_at(z, trial)
            length = given_length(trial.length_l0, faults)
            calcium = given_calcium(trial.calcium_um, faults)
            # Trials that begin alike settle alike, which on a strain grid is most of the work.
            with naming(f"trial {trial.name}"):
                force = outputs(muscle, trial.dt_s, length, calcium, settled=settled)["force_f0"]
            found.append(force if self.correction is None else force + self.correction.of_trial(trial.name, z))
        return found

    def recorded(self, z: Array, trial: FitTrial, force_f0: Array) -> Array:
        """Force as the file would hold it, at the times that count."""
        force = recorded_force(trial.time_s, force_f0, self.faults_at(z, trial), trial.order)
        return np.interp(trial.force_time_s, trial.time_s, force)

    def predicted(self, z: Array, trials: Sequence[FitTrial] | None = None) -> list[Array]:
        """Recorded force of trials (default: all) at a point, F0.

        Raises:
            UserError: see `true_forces`.
        """
        chosen = self.trials if trials is None else trials
        forces = self.true_forces(Muscle(self.fibre_at(z)), z, chosen)
        return [self.recorded(z, trial, force) for trial, force in zip(chosen, forces, strict=True)]

    def solution_shifts(self, z: Array) -> dict[float, float]:
        """Fitted pCa shift of each solution by stated pCa; features meet the solutions that the trials met."""
        return {
            float(c.group.removeprefix("pCa ")): float(moved)
            for c, moved in zip(self.coordinates, z, strict=True)
            if c.name == "pca_shift" and c.group is not None and c.group.startswith("pCa ")
        }

    @property
    def information(self) -> Array:
        """Of the priors, 1/SD², shape (coordinates,); 0 where there is none."""
        return np.array([c.prior_sd**-2.0 for c in self.coordinates])

    def prior(self, z: Array) -> Array:
        """Distance from the priors in standard deviations, shape (coordinates,); 0 where there is none."""
        means = np.array([c.prior_mean for c in self.coordinates])
        distance: Array = (z - means) * np.sqrt(self.information)
        return distance

    def to_json(self) -> dict[str, Any]:
        """Plain data, so that a worker elsewhere can have it."""
        rest = {name: value for name, value in vars(self).items() if name not in ("fibre", "_places")}
        return {"fibre": fibre_to_plain(self.fibre), **to_plain(rest)}

    @staticmethod
    def from_json(row: Mapping[str, Any]) -> Problem:
        """A problem from plain data."""
        return from_plain(Problem, {**row, "fibre": fibre_from_plain(row["fibre"])})


def touches(c: Coordinate, trial: FitTrial) -> bool:
    """Whether a coordinate bears on a trial."""
    if c.group is None:
        return True
    return _bears_on(c, trial.name, trial.solution)


def _bears_on(fault: Coordinate, trial: str, solution: str) -> bool:
    return fault.group == {Scope.TRIAL: trial, Scope.SOLUTION: solution, Scope.STUDY: ""}[ARTEFACTS[fault.name].scope]


def moves_simulation(c: Coordinate) -> bool:
    """Whether a coordinate bears on what the fibre does, or on its recording alone."""
    return c.group is None or ARTEFACTS[c.name].on_input
