"""The search: one explanation after another put beside the parameters, for as long as it explains more than noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.catalogue import CATALOGUE
from xb_muscle_ros.diagnose.closure import closure_error
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.refit import Fit, compile_task, fit_of, refit_task
from xb_muscle_ros.diagnose.screen import Linear, Screened, models, screen
from xb_muscle_ros.diagnose.study import Explanation, Study
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options, run

# What a further parameter has to take off the cost to be worth it (half the logarithm of some hundred independent
# samples), and what share of the cost a further explanation has to take off.
PENALTY = 3.0
_WORTH = 0.15
# A candidate is fitted if the line promises this share of what the best one promises, and this much of the cost.
_PROMISE, _LEAST_GAIN = 0.1, 6.0
# Half-sarcomeres are the same whichever is the stronger: their effect grows with the square of the spread, so that a
# line from its absence says little.
_NO_LINE = (Name.HALF_SARCOMERE_SPREAD,)


@dataclass(frozen=True)
class Effort:
    """How hard to look.

    Attributes:
        steps: explanations put together at most.
        candidates: fitted at the first step.
        later: fitted at each further step, where every one is a model that has to be compiled first.
        most: points to try in a fit.
        anew: leading explanations of a step that are fitted a second time, from the fibre file's own values.
        folds: into which trials are split for held-out scores.
        rivals: of the answer whose held-out scores are computed.
        draws: of the bootstrap.
        closure: rounds of taking out the Gaussian form's own error.
        profiled: whether the profile of the answer's parameter is followed.
    """

    steps: int = 3
    candidates: int = 8
    later: int = 4
    most: int = 40
    anew: int = 5
    folds: int = 7
    rivals: int = 4
    draws: int = 500
    closure: int = 2
    profiled: bool = True


QUICK = Effort(steps=2, candidates=6, later=3, most=20, anew=3, folds=3, rivals=2, draws=400, profiled=False)


@dataclass
class Search:
    """What the search found.

    Attributes:
        study: with the closure's error of the base.
        base: parameters alone.
        final: the explanation that was arrived at.
        fits: every explanation that was fitted, by label.
        screened: candidates at the base, the most promising first.
        linear: the base, taken as linear.
        unsolved: labels of explanations for which the model had no solution.
    """

    study: Study
    base: Fit
    final: Fit
    screened: Sequence[Screened]
    linear: Linear
    fits: dict[str, Fit] = field(default_factory=dict)
    unsolved: list[str] = field(default_factory=list)

    def rivals(self, name: Name) -> list[Fit]:
        """Fits with something else in the place of one name of the final explanation, the best first."""
        rest = self.final.explanation.without(name)
        found = [
            fit
            for fit in self.fits.values()
            if len(fit.explanation.names) == len(rest.names) + 1
            and set(rest.names) < set(fit.explanation.names)
            and name not in fit.explanation.names
        ]
        return sorted(found, key=penalised)


def penalised(fit: Fit) -> float:
    """Cost with what its parameters cost; a fault with a value for each trial counts once, its prior does the rest."""
    parameters = sum(len(CATALOGUE[name].parameters) for name in fit.explanation.mechanisms)
    return fit.cost + PENALTY * (parameters + len(fit.explanation.faults))


class Searcher:
    """Fits explanations of one study, each once."""

    def __init__(self, study: Study, effort: Effort, options: Options) -> None:
        self.study, self.effort, self.options = study, effort, options
        self.fits: dict[str, Fit] = {}
        self.unsolved: list[str] = []
        self._compiled: set[str] = set()

    def _tasks(self, wanted: Sequence[tuple[Explanation, Sequence[Mapping[str, float]]]]) -> list[dict[str, Any]]:
        """Tasks for `refit_task`; the study, which is long, is written out once for all of them."""
        plain = self.study.to_json()
        return [
            {
                "study": plain,
                "names": [n.value for n in explanation.names],
                "starts": [dict(s) for s in starts],
                "held_out": [],
                "most": self.effort.most,
                "predict": False,
            }
            for explanation, starts in wanted
        ]

    def fitted(self, wanted: Sequence[tuple[Explanation, Sequence[dict[str, float]]]], label: str) -> list[Fit]:
        """Fits of explanations, each from its starts; those without a solution are left out."""
        missing = [(e, starts) for e, starts in wanted if e.label not in self.fits]
        rows = run(refit_task, self._tasks(missing), replace(self.options, label=label))
        for (explanation, _), row in zip(missing, rows, strict=True):
            if row is None:
                self.unsolved.append(explanation.label)
            else:
                fit = fit_of(row)
                self.fits[fit.explanation.label] = fit
        return [self.fits[e.label] for e, _ in wanted if e.label in self.fits]

    def _anew(self, fits: Sequence[Fit]) -> list[Fit]:
        """The same explanations, those that lead and those that a poor start may have hidden fitted once more.

        Parameters that made up for what was missing lie far from where they belong with it, and valleys between are
        long: the second descent starts from the fibre file's own values of them.
        """
        order = sorted(fits, key=penalised)
        swapped = [f for f in order if any(CATALOGUE[n].effect is None for n in f.explanation.mechanisms)]
        again = [*order[: self.effort.anew], *(f for f in swapped if f not in order[: self.effort.anew])]
        own = {c.label for c in self.study.problem(Explanation(), {}).coordinates}
        found = {f.explanation.label: f for f in fits}
        wanted = []
        for fit in again:
            starts: list[dict[str, float]] = [{k: v for k, v in fit.values.items() if k not in own}]
            if len(fit.explanation.mechanisms) == 1:
                entry = CATALOGUE[fit.explanation.mechanisms[0]]
                starts += [dict(values) for values in entry.starting_values(self.study.fibre.values)]
            wanted.append((fit.explanation, starts))
        for row in run(refit_task, self._tasks(wanted), replace(self.options, label="once more")):
            if row is not None and (fit := fit_of(row)).cost < found[fit.explanation.label].cost:
                found[fit.explanation.label] = self.fits[fit.explanation.label] = fit
        return list(found.values())

    def base(self, significant: Callable[[Study, Fit], bool]) -> Fit:
        """Parameters alone, with the closure's error of where they end taken out where they leave more than noise.

        A recording that the Gaussian form reproduces (one that it made, say) shows none of that error.

        Raises:
            UserError: the model has no solution at the fibre's own values.
        """
        starts: list[dict[str, float]] = [{}, *_spread(self.study)]
        found = self.fitted([(Explanation(), starts)], "base")
        if not found:
            raise UserError(
                f"fibre {self.study.fibre.name}, model {self.study.fibre.model}: no solution at the values of the "
                "fibre file; start from another one"
            )
        if not self.effort.closure or not significant(self.study, found[0]):
            return found[0]
        for _ in range(self.effort.closure):
            self.study = replace(self.study, closure_f0=closure_error(self.study, found[0]))
            self.fits.clear()
            found = self.fitted([(Explanation(), [dict(found[0].values)])], "closure") or found
        return found[0]

    def search(self, significant: Callable[[Study, Fit], bool]) -> Search:
        """Search until what is left is not significant any more, or nothing more is worth it.

        Args:
            significant: whether more than noise is left of a fit.
        """
        base = final = self.base(significant)
        linear = Linear.of(self.study, base)
        screened = self._screened(base, linear)
        found = Search(self.study, base, final, screened, linear, self.fits, self.unsolved)
        candidates: Sequence[Screened] = screened
        for step in range(self.effort.steps):
            if not significant(self.study, final):
                break
            if step > 0:
                candidates = self._screened(final, Linear.of(self.study, final))
            better = self._step(final, candidates, step)
            if better is None:
                break
            final = better
        found.final = self._pruned(final)
        if self._does_without_closure(found.final, significant):
            self.study, self.effort = replace(self.study, closure_f0={}), replace(self.effort, closure=0)
            self.fits = {}
            return self.search(significant)
        return found

    def _does_without_closure(self, final: Fit, significant: Callable[[Study, Fit], bool]) -> bool:
        """Whether the Gaussian form with what was named reproduces the recordings, and better so as it is.

        What was taken out of it is then an error that the recordings do not have, and part of what was named may only
        put it back.
        """
        if not self.study.closure_f0 or not final.explanation.names:
            return False
        study = replace(self.study, closure_f0={})
        task = {**self._tasks([(final.explanation, [final.values])])[0], "study": study.to_json()}
        (row,) = run(refit_task, [task], replace(self.options, label="closure"))
        if row is None:
            return False
        plain = fit_of(row)
        return plain.cost < final.cost and not significant(study, plain)

    def _screened(self, fit: Fit, linear: Linear) -> list[Screened]:
        """Candidates beside a fit, their models compiled side by side first: one takes seconds, and they are many."""
        wanted = [e for e in models(self.study, fit.explanation) if e.label not in self._compiled]
        self._compiled.update(e.label for e in wanted)
        if self.options.processes != 0 and self.options.scheduler is None and len(wanted) > 1:
            # Finished or not, a run that goes on later may meet an empty cache: not a result to be kept.
            options = replace(self.options, journal=None, label="compiling")
            plain = self.study.to_json()
            tasks = [{"study": plain, "names": [n.value for n in e.names]} for e in wanted]
            run(compile_task, tasks, options)
        return screen(self.study, fit, linear)

    def _step(self, final: Fit, candidates: Sequence[Screened], step: int) -> Fit | None:
        """The best fit with one more explanation, or None where none is worth it."""
        chosen = _promising(candidates, final.cost, self.effort.later if step else self.effort.candidates, step == 0)
        wanted = [(final.explanation.plus(s.name), s.starts) for s in chosen]
        fits = self._anew(self.fitted(wanted, f"step {step + 1}"))
        best = min(fits, key=penalised, default=None)
        if best is None or penalised(final) - penalised(best) < max(2.0 * PENALTY, _WORTH * final.cost):
            return None
        return best

    def _pruned(self, final: Fit) -> Fit:
        """Without what later steps have made superfluous."""
        names = final.explanation.names
        if len(names) < 2:
            return final
        without = [(final.explanation.without(n), (dict(final.values),)) for n in names]
        fits = self.fitted(without, "superfluous")
        best = min(fits, key=penalised, default=final)
        worth = max(2.0 * PENALTY, _WORTH * best.cost)
        return self._pruned(best) if penalised(best) - penalised(final) < worth else final

    def compete(self, found: Search) -> None:
        """Fit what might stand in the place of each name of the final explanation, so that it has rivals."""
        for name in found.final.explanation.names if len(found.final.explanation.names) > 1 else ():
            rest = self.fits.get(found.final.explanation.without(name).label)
            if rest is None:
                continue
            linear = Linear.of(self.study, rest)
            chosen = _promising(self._screened(rest, linear), rest.cost, self.effort.rivals, False)
            self.fitted([(rest.explanation.plus(s.name), s.starts) for s in chosen], "rivals")


def _promising(candidates: Sequence[Screened], cost: float, most: int, all_blind: bool) -> list[Screened]:
    """Candidates worth a fit: those that only a fit can tell, and the most promising of the others."""
    no_line = _NO_LINE if all_blind else ()
    blind = [s for s in candidates if np.isnan(s.gain) or s.name in no_line]
    told = [s for s in candidates if not np.isnan(s.gain) and s.name not in no_line]
    best = max((s.gain for s in told), default=0.0)
    return [*blind, *(s for s in told if s.gain >= max(_PROMISE * best, _LEAST_GAIN, 0.01 * cost))][: most + len(blind)]


def _spread(study: Study) -> list[dict[str, float]]:
    """Further points to start the base from: more and less cooperativity, faster and slower heads."""
    values = study.fibre.values
    found: list[dict[str, float]] = []
    for factors in ({"koop": 3.0, "kon": 0.6}, {"koop": 0.4, "kon": 1.4}, {"f": 0.7, "k11": 0.5}):
        start = {name: values[name] * factor for name, factor in factors.items() if values.get(name, 0.0) > 0.0}
        if start and start not in found:
            found.append(start)
    return found
