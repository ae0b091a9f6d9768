"""The search: sets of mechanisms and artefacts, one more at a time, and then everything beside the best of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from xb_muscle_ros.diagnose.answers import NAMES
from xb_muscle_ros.diagnose.effort import Effort
from xb_muscle_ros.diagnose.inference.population import Estimate, adjustment
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.search.descent import Fit, fit_task
from xb_muscle_ros.diagnose.search.promise import Linear, Promise, promise
from xb_muscle_ros.diagnose.search.system import Names, System, label, ordered, without
from xb_muscle_ros.diagnose.search.whole import beside, together
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.work import Options, run

# Chance, before anything is seen, that a mechanism is part of the truth, or an artefact beyond the ordinary.
_PRIOR_ODDS = {True: np.log(0.1), False: np.log(0.05)}
# A set is worth going on from if the evidence rises by so much.
_WORTH = 0.5
# One step may cost so much evidence, in case the next one makes up for it.
_PATIENCE = 3.0
# Form errors of mechanisms: share of what a mechanism does that its form here gets wrong.
FORM = 0.12
# Of a set whose curvature is not known.
_NONE = -1e9


def spread(system: System) -> list[dict[str, float]]:
    """Further points to start the base from: more and less cooperativity, faster and slower heads."""
    values = system.fibre.values
    found: list[dict[str, float]] = []
    for factors in ({"koop": 3.0, "kon": 0.6}, {"koop": 0.4, "kon": 1.4}, {"f": 0.7, "k11": 0.5}):
        start = {name: values[name] * factor for name, factor in factors.items() if values.get(name, 0.0) > 0.0}
        if start and start not in found:
            found.append(start)
    return found


class Explorer:
    """Fits sets to every fibre of a study, each once.

    Attributes:
        fits: by set, one for each fibre; sets for which the model has no solution in some fibre are in `unsolved`.
        promised: first-order mean squares by set, one for each fibre, of sets that were not fitted.
    """

    def __init__(self, systems: Sequence[System], effort: Effort, options: Options) -> None:
        self.systems, self.effort, self.options = list(systems), effort, options
        self.fits: dict[Names, tuple[Fit, ...]] = {}
        self.promised: dict[Names, tuple[float, ...]] = {}
        self.unsolved: list[Names] = []
        self._estimates: dict[Names, dict[str, list[Estimate]]] = {}
        self._adjusted: dict[tuple[Names, tuple[int, ...]], float] = {}
        self._linear: dict[Names, list[Linear]] = {}
        self.floors_f0 = [s.noise_f0 for s in systems]

    def fit(
        self, wanted: Sequence[tuple[Collection[Name], Sequence[Sequence[Mapping[str, float]]]]], why: str
    ) -> list[Names]:
        """Fit sets, each with starts for every fibre; those that have a solution in all of them."""
        missing = [(ordered(names), starts) for names, starts in wanted if ordered(names) not in self.fits]
        plains = [s.to_json() for s in self.systems] if missing else []
        tasks = [
            {
                "system": plain,
                "names": list(names),
                "starts": [dict(s) for s in of_fibre],
                "most": self.effort.most,
                "tolerance": self.effort.tolerance,
            }
            for names, starts in missing
            for plain, of_fibre in zip(plains, starts, strict=True)
        ]
        rows = run(fit_task, tasks, replace(self.options, label=why)) if tasks else []
        count = len(self.systems)
        for i, (names, _) in enumerate(missing):
            own = [row for row in rows[i * count : (i + 1) * count] if row is not None]
            if len(own) < count:
                self.unsolved.append(names)
            else:
                self.fits[names] = tuple(Fit.from_json(row) for row in own)
        return [ordered(names) for names, _ in wanted if ordered(names) in self.fits]

    def linear(self, names: Names) -> list[Linear]:
        """Fits of a set, taken as linear."""
        if names not in self._linear:
            self._linear[names] = [Linear(s, f) for s, f in zip(self.systems, self.fits[names], strict=True)]
        return self._linear[names]

    def evidence(self, names: Names, fibres: Sequence[int] | None = None) -> float:
        """Logarithm of a set's probability but for a constant, by all fibres together or by some."""
        chosen = range(len(self.systems)) if fibres is None else fibres
        fits = self.fits[names]
        own = [fits[i].cost(self.systems[i], self.floors_f0[i]) + fits[i].occam for i in chosen]
        found = self.odds(names) + self.adjusted(names, chosen) - float(sum(own))
        return found if np.isfinite(found) else _NONE

    def estimates(self, names: Names) -> dict[str, list[Estimate]]:
        """Coordinates of the mechanisms of a set in every fibre, by label."""
        if names not in self._estimates:
            fits = self.fits[names]
            own = [n for n in names if n not in MEASUREMENT]
            effects = {CATALOGUE[n].effect for n in own}
            labels = dict.fromkeys(label for n in own for label in CATALOGUE[n].parameters)
            found: dict[str, list[Estimate]] = {label: [] for label in labels}
            for system, fit in zip(self.systems, fits, strict=True):
                coordinates = {c.label: c for c in system.problem(names, fit.values).coordinates}
                for key in labels:
                    c = coordinates[key]
                    value, sd = c.inward(fit.values[key]), fit.sds[key]
                    found[key].append(Estimate(value, sd, c.prior_mean, c.prior_sd, key in effects))
            self._estimates[names] = found
        return self._estimates[names]

    def adjusted(self, names: Names, fibres: Sequence[int]) -> float:
        """What it adds to the evidence that effects are mostly small, and alike in these fibres."""
        key = names, tuple(fibres)
        if key not in self._adjusted:
            rows = self.estimates(names).values()
            self._adjusted[key] = sum(adjustment([row[i] for i in fibres]) for row in rows)
        return self._adjusted[key]

    @staticmethod
    def odds(names: Names) -> float:
        """Logarithm of the chance of a set before anything is seen."""
        return float(sum(_PRIOR_ODDS[n not in MEASUREMENT] for n in names))

    def best(self) -> Names:
        """The set with the most evidence."""
        return max(self.fits, key=self.evidence)

    def refloor(self) -> None:
        """Count what forms of mechanisms get wrong as noise, by what they do."""
        best = self.best()
        for i, system in enumerate(self.systems):
            gone = max(self.fits[()][i].mean_square_f0 - self.fits[best][i].mean_square_f0, 0.0)
            self.floors_f0[i] = float(np.sqrt(system.noise_f0**2 + FORM**2 * gone))

    def candidates(self, names: Names) -> list[Name]:
        """What may be put beside a set."""
        allowed = set.intersection(*(set(beside(s.fibre)) for s in self.systems))
        beside_it = [n for n in NAMES if (n in allowed or n in MEASUREMENT) and n not in names]
        return [n for n in beside_it if together((*names, n))]

    def promises(self, names: Names) -> dict[Name, list[Promise]]:
        """What every candidate promises beside a set, in every fibre."""
        linear = self.linear(names)
        found: dict[Name, list[Promise]] = {}
        for name in self.candidates(names):
            try:
                found[name] = [promise(one, name) for one in linear]
            except (UserError, np.linalg.LinAlgError):
                continue
            squares = tuple(p.mean_square_f0 for p in found[name])
            if np.all(np.isfinite(squares)):
                self.promised[ordered((*names, name))] = squares
        return found

    def step(self, names: Names, count: int, blind: bool) -> list[Names]:
        """Fit the most promising candidates beside a set."""
        promises = self.promises(names)
        gains = {n: float(sum(p.gain for p in ps)) for n, ps in promises.items()}
        ranked = sorted((n for n in gains if not np.isnan(gains[n])), key=lambda n: -gains[n])
        # An odd name more costs its odds; what promises less than that is not fitted.
        chosen = [n for n in ranked if gains[n] > 1.0][:count]
        chosen += [n for n in gains if np.isnan(gains[n]) and blind]
        wanted = [((*names, n), self.starts(promises[n])) for n in chosen]
        return self.fit(wanted, f"{label(names)} and one more")

    def starts(self, promised: Sequence[Promise]) -> list[list[Mapping[str, float]]]:
        """Where the fit of a candidate starts in every fibre."""
        if not np.isnan(promised[0].gain):
            return [[*p.starts] for p in promised]
        catalogue = CATALOGUE[promised[0].name]
        return [
            [*p.starts, *catalogue.starting_values(s.fibre.values)] for p, s in zip(promised, self.systems, strict=True)
        ]

    def base(self) -> None:
        """Fit the base, from several starts.

        Raises:
            UserError: the model has no solution in some fibre.
        """
        if () not in self.fits:
            self.fit([((), [[{}, *spread(s)] for s in self.systems])], "base")
        if () not in self.fits:
            names = ", ".join(s.fibre.name for s in self.systems)
            raise UserError(
                f"fibre {names}, model {self.systems[0].fibre.model}: no solution at the values of the fibre file; "
                "start from another one"
            )

    def anew(self, systems: Sequence[System]) -> None:
        """Other systems; fits start where those of the former ones ended."""
        starts = self.ends(())
        self.systems = list(systems)
        for kept in (self.fits, self.promised, self.unsolved, self._estimates, self._adjusted, self._linear):
            kept.clear()
        self.fit([((), starts)], "base once more")
        self.base()

    def explore(self) -> Names:
        """Search; the set with the most evidence."""
        self.base()
        current: Names = ()
        best, behind = current, 0
        for k in range(self.effort.steps):
            found = self.step(current, self.effort.candidates, blind=k < 2)
            self.refloor()
            ahead = max(found, key=self.evidence, default=current)
            if ahead == current:
                break
            # What two mechanisms do together may hide what each does: one step that gains nothing is taken.
            behind = 0 if self.evidence(ahead) >= self.evidence(best) + _WORTH else behind + 1
            if behind > 1 or self.evidence(ahead) < self.evidence(best) - _PATIENCE:
                break
            current = ahead if behind else self._pruned(ahead)
            best = best if behind else current
        self.refloor()
        current = self.best()
        self._around(current)
        self.refloor()
        again = self.best()
        if again != current:
            self._around(again)
        return self.best()

    def _pruned(self, names: Names) -> Names:
        """Without what has become superfluous."""
        if len(names) < 2:
            return names
        shorter = self.shorter(names)
        best = max(shorter, key=self.evidence, default=names)
        return self._pruned(best) if self.evidence(best) > self.evidence(names) else names

    def ends(self, names: Names) -> list[list[Mapping[str, float]]]:
        """Where the fits of a set ended, as starts for every fibre."""
        return [[f.values] for f in self.fits[names]]

    def shorter(self, names: Names, why: str = "") -> list[Names]:
        """Fit a set without each of its names in turn."""
        return self.fit([(without(names, n), self.ends(names)) for n in names], why or f"{label(names)} but one")

    def _around(self, names: Names) -> None:
        """Fit what is beside a set: without each name, with another in its place, with one more."""
        self.shorter(names)
        for n in names:
            rest = without(names, n)
            if rest in self.fits:
                self.step(rest, self.effort.rivals, blind=len(names) <= 1)
        self.step(names, self.effort.rivals, blind=False)
