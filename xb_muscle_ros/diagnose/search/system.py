"""One fibre of a study: its trials and the fit of any set of mechanisms and artefacts to them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.answers import NAMES
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.search.thinning import thinned
from xb_muscle_ros.diagnose.search.whole import frame_of, whole
from xb_muscle_ros.fit.coordinates import Coordinate, fault_coordinates, mechanism_coordinates, parameter_coordinates
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.features import F0_ANCHOR, Feature
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY
from xb_muscle_ros.mechanisms import Entry
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.trials.trial import Array

Names = tuple[Name, ...]

SATURATING = f"pCa {F0_ANCHOR.pca:g}"
"""Solution whose isometric force is F0."""
# Residuals that count as independent resemble each other still: a misfit lasts as long as its phase.
INDEPENDENT = 0.6
# A value this near a bound, as a share of the way between bounds, ended there.
_AT_BOUND = 1e-3
BEYOND = 6.0
"""An artefact that is named may be so much larger than an ordinary one."""


def ordered(names: Collection[str]) -> Names:
    """Names of a set in their usual order, each once."""
    return tuple(name for name in NAMES if name in set(names))


def without(names: Names, name: Name) -> Names:
    """The other names of a set."""
    return tuple(n for n in names if n is not name)


def label(names: Collection[str]) -> str:
    """A set for people and files."""
    return " + ".join(ordered(names)) or "base"


@dataclass(frozen=True)
class System:
    """Trials of one fibre with the fibre that is to explain them.

    Attributes:
        fibre: as it was given: start values, model, method; smoothing off.
        trials: thinned, in the order of recording.
        weights: of the samples of all trials, one below the other, shape (n,): independent residuals each stands for.
        noise_f0: standard deviation that a residual has at least, noise and numerics, F0.
        closure_f0: what the Gaussian form leaves out of the distribution's force at the thinned times, by trial.
        features: isometric forces and SRS to be met beside the traces.
        error_sds: standard deviations of ordinary measurement errors that replace those of the table, by name.
    """

    fibre: Fibre
    trials: tuple[FitTrial, ...]
    weights: Array
    noise_f0: float
    closure_f0: Mapping[str, Array] = field(default_factory=dict)
    features: tuple[Feature, ...] = ()
    error_sds: Mapping[str, float] = field(default_factory=dict)

    @staticmethod
    def of(fibre: Fibre, trials: Sequence[FitTrial], noise_f0: float) -> System:
        """Of trials as they were recorded."""
        parts = [thinned(trial) for trial in trials]
        weights = np.concatenate([part.weights for part in parts])
        return System(fibre, tuple(part.trial for part in parts), weights, noise_f0)

    @property
    def effective_samples(self) -> float:
        """Effective sample size: how many independent residuals there are."""
        return INDEPENDENT * float(np.sum(self.weights))

    def log_likelihood(self, mean_square_f0: float, floor_f0: float | None = None) -> float:
        """Of residuals of a mean square (F0²), their scale profiled out, but for a constant.

        Args:
            mean_square_f0: weighted.
            floor_f0: standard deviation that they have at least, F0; None for the noise.
        """
        floor = self.noise_f0 if floor_f0 is None else floor_f0
        return -0.5 * self.effective_samples * float(np.log(floor**2 + mean_square_f0))

    @property
    def measured(self) -> Array:
        """Force of all trials, one below the other, F0."""
        return np.concatenate([t.measured_f0 for t in self.trials])

    def without(self, held_out: Collection[str]) -> System:
        """The system without some trials."""
        sizes = [t.measured_f0.size for t in self.trials]
        keep = np.repeat([t.name not in held_out for t in self.trials], sizes)
        kept = tuple(t for t in self.trials if t.name not in held_out)
        made = replace(self, trials=kept, weights=self.weights[keep])
        # Forces are in units of the isometric force at saturating calcium, which holds though nobody shows it.
        saturating = [t for t in self.trials if t.solution == SATURATING]
        if saturating and not any(t.solution == SATURATING for t in kept):
            made = replace(made, features=(*self.features, F0_ANCHOR))
        return made

    def problem(self, names: Collection[str], values: Mapping[str, float]) -> Problem:
        """The fit of a set.

        Args:
            values: by label of coordinate, for those that are not to start as the fibre or the catalogue says; those
                of mechanisms that are not in the set are left alone.
        """
        names = ordered(names)
        fibre = whole(self.fibre, frame_of(names))
        present = dict(fibre.values)
        coordinates = [c for c in parameter_coordinates(self.fibre, None, (), {}, {}) if c.name in present]
        for name in (n for n in names if n not in MEASUREMENT):
            entry = CATALOGUE[name]
            start = entry.starting_values(self.fibre.values)[0]
            # What the catalogue starts from besides what is fitted, such as a rate of rebinding.
            present |= {n: float(v) for n, v in start.items() if n in present}
            present |= {key: _usual(key) for key in entry.off if key not in entry.parameters}
            coordinates += _of_mechanism(entry, self.fibre.values, present)
        for c in coordinates:
            present[c.name] = values.get(c.name, present[c.name])
        fibre = replace(fibre, values=present)
        coordinates += self._artefacts(names)
        merged = tuple(_started(c, values, present) for c in {c.label: c for c in coordinates}.values())
        correction = Correction.level(self.closure_f0, np.zeros(len(self.features))) if self.closure_f0 else None
        return Problem(fibre, self.trials, merged, {}, self.features, correction)

    def error_sd(self, name: str) -> float:
        """Standard deviation of an ordinary measurement error, in its unit."""
        return self.error_sds.get(name, ARTEFACTS[name].sd)

    def _artefacts(self, names: Names) -> list[Coordinate]:
        """Ordinary measurement errors, wider where named, and those that are in a set only."""
        named: set[str] = {n for n in names if n in MEASUREMENT}
        wanted = [n for n in ARTEFACTS if n in ORDINARY or n in named]
        sds = {**self.error_sds, **{n: BEYOND * self.error_sd(n) for n in named}}
        trials, solutions = [t.name for t in self.trials], [t.solution for t in self.trials]
        return list(fault_coordinates(wanted, trials, solutions, sds))

    def to_json(self) -> dict[str, Any]:
        """Plain data, so that a worker elsewhere can have it."""
        return {
            "problem": Problem(self.fibre, self.trials, (), {}, self.features).to_json(),
            "weights": self.weights.tolist(),
            "noise_f0": self.noise_f0,
            "closure_f0": {name: values.tolist() for name, values in self.closure_f0.items()},
            "error_sds": dict(self.error_sds),
        }

    @staticmethod
    def from_json(row: Mapping[str, Any]) -> System:
        """A system from plain data."""
        problem = Problem.from_json(row["problem"])
        closure = {name: np.array(values, dtype=np.float64) for name, values in row["closure_f0"].items()}
        weights = np.array(row["weights"])
        return System(
            problem.fibre, problem.trials, weights, row["noise_f0"], closure, problem.features, row["error_sds"]
        )


def at_bound(c: Coordinate, z: float) -> bool:
    """Whether a coordinate's value on the moved scale ended at a bound."""
    low, high = c.inward(c.lower), c.inward(c.upper)
    return not _AT_BOUND * (high - low) < z - low < (1.0 - _AT_BOUND) * (high - low)


def _usual(parameter: str) -> float:
    """Value of a parameter that switches a block on."""
    default = PARAMETERS[parameter].default
    assert default is not None
    return float(default)


def _of_mechanism(entry: Entry, base: Mapping[str, float], present: Mapping[str, float]) -> list[Coordinate]:
    """Coordinates of a mechanism; the priors of its shapes favour none of the values that it may start from."""
    starts = entry.starting_values(base)
    middle = {n: float(starts[0].get(n, present[n])) for n in entry.parameters}
    for name in entry.shape:
        tried = np.array([float(start.get(name, present[name])) for start in starts])
        middle[name] = float(np.exp(np.mean(np.log(tried))) if np.all(tried > 0.0) else np.mean(tried))
    return list(mechanism_coordinates(entry, middle))


def _started(c: Coordinate, values: Mapping[str, float], present: Mapping[str, float]) -> Coordinate:
    """A coordinate that starts where it is said to, within its bounds."""
    value = values.get(c.label, present.get(c.name, c.start) if c.group is None else c.start)
    return replace(c, start=min(max(value, c.lower), c.upper))
