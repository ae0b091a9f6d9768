"""A study: trials of one fibre, and the problems that fitting them with a set of explanations makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.catalogue import CATALOGUE, Entry
from xb_muscle_ros.diagnose.names import MECHANISMS, Name
from xb_muscle_ros.fit.coordinates import Coordinate, fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.noise import Scale
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import compose, model_of_set, with_mechanisms

Array = npt.NDArray[np.float64]

# What counts as one standard deviation of a difference while fitting: priors weigh in where the data say no more than
# this. Real residuals are correlated over some tens of milliseconds.
SCALE = Scale(force_sd_f0=0.002, correlation_samples=30.0)


@dataclass(frozen=True)
class Explanation:
    """What is put beside the parameters of the base model: mechanisms and faults of the measurement, in this order.

    Attributes:
        mechanisms: put into the model.
        faults: of the measurement, each free within its prior.
    """

    mechanisms: tuple[Name, ...] = ()
    faults: tuple[Name, ...] = ()

    @property
    def names(self) -> tuple[Name, ...]:
        """All of them."""
        return (*self.mechanisms, *self.faults)

    @property
    def label(self) -> str:
        """Name for people and files."""
        return " + ".join(name.value for name in self.names) or "base"

    def plus(self, name: Name) -> Explanation:
        """With one more."""
        if name in MECHANISMS:
            return replace(self, mechanisms=(*self.mechanisms, name))
        return replace(self, faults=(*self.faults, name))

    def without(self, name: Name) -> Explanation:
        """With one less."""
        return Explanation(
            tuple(n for n in self.mechanisms if n is not name), tuple(n for n in self.faults if n is not name)
        )


@dataclass(frozen=True)
class Study:
    """Trials of one fibre with the fibre that is to explain them.

    Attributes:
        fibre: as it was given: start values, model, method.
        trials: all of them, none held out.
        closure_f0: what the Gaussian form of the model leaves out of the distribution's force at the trial's samples,
            F0, by trial; it is added in every fit, so that no mechanism is called upon to explain it. Empty: nothing.
    """

    fibre: Fibre
    trials: tuple[FitTrial, ...]
    closure_f0: Mapping[str, Array] = field(default_factory=dict)

    def problem(
        self, explanation: Explanation, start: Mapping[str, float], held_out: frozenset[str] = frozenset()
    ) -> Problem:
        """The fit of an explanation.

        Args:
            explanation: what is put beside the base model's parameters.
            start: values by label of coordinate, for those that are not to start as the fibre or the catalogue says.
            held_out: names of trials to leave out.
        """
        fibre = fibre_with(self.fibre, explanation.mechanisms, start)
        trials = tuple(replace(t, held_out=t.name in held_out) for t in self.trials)
        training = [t for t in trials if not t.held_out]
        coordinates = [
            *_base_coordinates(self.fibre, fibre),
            *(c for name in explanation.mechanisms for c in CATALOGUE[name].coordinates(fibre.values)),
        ]
        names = [name.value for name in explanation.faults]
        coordinates += fault_coordinates(names, [t.name for t in training], [t.solution for t in training], {})
        merged = tuple(_started(c, start) for c in {c.label: c for c in coordinates}.values())
        return Problem(fibre, trials, merged, {}, correction=self.correction(len(merged)))

    def correction(self, coordinates: int) -> Correction | None:
        """The closure's error, the same at every point."""
        if not self.closure_f0:
            return None
        return Correction(
            at=np.zeros(coordinates),
            force=self.closure_f0,
            force_slopes={},
            features=np.empty(0),
            feature_slopes=np.empty((0, coordinates)),
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data, so that a worker elsewhere can have it."""
        return {
            "problem": Problem(self.fibre, self.trials, (), {}).to_json(),
            "closure_f0": {name: values.tolist() for name, values in self.closure_f0.items()},
        }

    @staticmethod
    def from_json(row: Mapping[str, Any]) -> Study:
        """A study from plain data."""
        problem = Problem.from_json(row["problem"])
        closure = {name: np.array(values, dtype=np.float64) for name, values in row["closure_f0"].items()}
        return Study(problem.fibre, problem.trials, closure)


def _started(c: Coordinate, start: Mapping[str, float]) -> Coordinate:
    """A coordinate that starts where it is said to, within its bounds."""
    value = start.get(c.label, c.start)
    return replace(c, start=min(max(value, c.lower), c.upper))


def _base_coordinates(given: Fibre, fibre: Fibre) -> list[Coordinate]:
    """Coordinates of the parameters that the fibre as given and the model with mechanisms share."""
    free = parameter_coordinates(given, None, (), {}, {})
    return [c for c in free if c.name in fibre.values]


def fibre_with(fibre: Fibre, mechanisms: Sequence[Name], values: Mapping[str, float]) -> Fibre:
    """A fibre whose model has these mechanisms.

    Args:
        fibre: as given.
        mechanisms: to put into its model.
        values: of parameters, by name, in place of the fibre's own and of defaults; others may be among them.

    Raises:
        UserError: a mechanism that does not go with the model.
    """
    if not mechanisms and not values:
        return fibre
    name = with_mechanisms(fibre.model, *(m.value for m in mechanisms))
    model = model_of_set(name)
    needed = {row.name for row in compose(model, fibre.method).parameters}
    start: dict[str, float] = {key: value for key, value in fibre.values.items() if key in needed}
    for mechanism in mechanisms:
        for key, value in CATALOGUE[mechanism].starting_values(fibre.values)[0].items():
            start.setdefault(key, value)
    start.update({key: value for key, value in values.items() if key in needed})
    full = complete(start, model, f"fibre {fibre.name}, model {name}", fibre.method)
    return replace(fibre, model=name, values=MappingProxyType(full))


def entry_starts(entry: Entry, fibre: Fibre, at: Mapping[str, float]) -> list[dict[str, float]]:
    """Points from which a mechanism's fit may start: those of the fit so far, with the mechanism's own values."""
    base = {**fibre.values, **at}
    return [{**at, **values} for values in entry.starting_values(base)]
