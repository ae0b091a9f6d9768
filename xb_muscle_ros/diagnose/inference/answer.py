"""From averages and held-out predictions to components and verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from xb_muscle_ros.diagnose.answers import FAMILY, NAMES
from xb_muscle_ros.diagnose.component import NAMED, SURE, Component, Kind, OfFibre, Parameter
from xb_muscle_ros.diagnose.inference.averaging import Averaged, averaged, grouped
from xb_muscle_ros.diagnose.inference.calibration import (
    ARTEFACTS,
    CONSTANTS,
    MOST_LOG_ODDS,
    PRACTICAL_F0,
    calibrated,
)
from xb_muscle_ros.diagnose.inference.heldout import HeldOut
from xb_muscle_ros.diagnose.inference.population import distribution
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import Names, at_bound, ordered
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.measurement.artefacts import ARTEFACTS as ARTEFACTS_BY_NAME
from xb_muscle_ros.measurement.artefacts import ORDINARY
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.parameters import PARAMETERS

_NORMAL = 1.959964


@dataclass(frozen=True)
class Judged:
    """A study, searched and predicted.

    Attributes:
        averages: over all fibres.
        of_fibres: of each fibre.
        without_fibres: of all fibres but each; empty where there is one.
        noise_f0: of each fibre's recordings.
    """

    explorer: Explorer
    heldout: HeldOut
    averages: Averaged
    of_fibres: tuple[Averaged, ...]
    without_fibres: tuple[Averaged, ...]
    noise_f0: tuple[float, ...]

    @staticmethod
    def of(explorer: Explorer, heldout: HeldOut, noise_f0: Sequence[float]) -> Judged:
        """With averages over what was searched."""
        fibres = range(len(explorer.systems))
        whole = averaged(explorer)
        if len(fibres) == 1:
            return Judged(explorer, heldout, whole, (whole,), (), tuple(noise_f0))
        each = tuple(averaged(explorer, [i]) for i in fibres)
        others = tuple(averaged(explorer, [k for k in fibres if k != i]) for i in fibres)
        return Judged(explorer, heldout, whole, each, others, tuple(noise_f0))

    @property
    def groups(self) -> list[tuple[Name, ...]]:
        """Components as names that stand together."""
        names = [n for n in NAMES if any(n in s for s in self.averages.sets)]
        return grouped(self.averages, names)

    def probability(self, group: Sequence[Name], fibre: int | None = None) -> float:
        """Inclusion probability of a component, by all fibres or by one."""
        averages = self.averages if fibre is None else self.of_fibres[fibre]
        # The base takes up ordinary errors, however large: what naming one gains is no residual, but its improbability.
        ordinary = all(n in ORDINARY for n in group)
        size_f0 = PRACTICAL_F0 if ordinary else averages.contribution_f0(group)
        constants = ARTEFACTS if group[0] in MEASUREMENT else CONSTANTS
        return calibrated(averages.log_odds(group), size_f0, constants)

    def replication(self, group: Sequence[Name], fibre: int) -> float | None:
        """Log Bayes factor: by how much a fibre raises the log-odds that the other fibres alone give a component.

        None where there is no other fibre, or where no fitted set has the component or none is without it.
        """
        if not self.without_fibres:
            return None
        # What was only promised is worth no more than its cap, whatever a fibre says.
        raised = self.averages.fitted_alone.log_odds(group) - self.without_fibres[fibre].fitted_alone.log_odds(group)
        return min(max(raised, -MOST_LOG_ODDS), MOST_LOG_ODDS) if math.isfinite(raised) else None

    def explained(self, names: Names) -> float:
        """Share of the base's mean square beyond noise that a set takes away; between 0 and 1."""
        before = self._excess((), None)
        return float(np.clip(1.0 - self._excess(names, None) / before, 0.0, 1.0)) if before > 0.0 else 0.0

    def ablation_loss(self, names: Names, without: Names, fibre: int | None = None) -> float:
        """What a set loses without a part of it, all else fitted anew, as a share of the base's mismatch."""
        before = self._excess((), fibre)
        if before <= 0.0 or without not in self.explorer.fits:
            return 0.0
        back = self._squares(without, fibre) - self._squares(names, fibre)
        return float(np.clip(back / before, 0.0, 1.0))

    def _squares(self, names: Names, fibre: int | None) -> float:
        fits = self.explorer.fits[names]
        return float(sum(fit.mean_square_f0 for fit in (fits if fibre is None else [fits[fibre]])))

    def _excess(self, names: Names, fibre: int | None) -> float:
        noise_f0 = self.noise_f0 if fibre is None else [self.noise_f0[fibre]]
        return self._squares(names, fibre) - sum(noise**2 for noise in noise_f0)

    @property
    def chosen(self) -> Names:
        """The set that stands for the answer: the most probable one with every component that is named and no other.

        Of a component with several members the likeliest.
        """
        wanted = [g for g in self.groups if self.probability(g) >= NAMED]
        named = {n for g in wanted for n in g}
        fitted = [s for s in self.explorer.fits if set(s) <= named and all(len(set(s) & set(g)) == 1 for g in wanted)]
        if fitted:
            return max(fitted, key=self.explorer.evidence)
        return ordered([g[0] for g in wanted])


def components(judged: Judged) -> tuple[Component, ...]:
    """All candidates, the most probable first; those of the answer with all that is known of them."""
    chosen = judged.chosen
    found = [_component(judged, group, chosen) for group in judged.groups]
    return tuple(sorted(found, key=lambda c: -c.inclusion_probability))


def _component(judged: Judged, group: tuple[Name, ...], chosen: Names) -> Component:
    e = judged.explorer
    probability = judged.probability(group)
    own = next((n for n in group if n in chosen), None)
    lead = own or group[0]
    names = [n for n in NAMES if n not in group]
    rivals = judged.averages.rivals(lead, [n for n in names if (n in MEASUREMENT) == (lead in MEASUREMENT)])
    without = tuple(n for n in chosen if n is not own)
    share, gain = 0.0, None
    if own is not None:
        share = judged.ablation_loss(chosen, without)
        gain = judged.heldout.gain(chosen, without)
    best = max((s for s in e.fits if lead in s), key=e.evidence, default=None)
    members = tuple(sorted(group, key=lambda n: (n is not lead, -judged.averages.including([n]))))
    by_fibre = tuple(
        OfFibre(
            fibre=system.fibre.name,
            inclusion_probability=judged.probability(group, i),
            ablation_loss=judged.ablation_loss(chosen, without, i) if own is not None else 0.0,
            heldout_gain=judged.heldout.gain(chosen, without, i) if own is not None else None,
            parameters=() if best is None else _of_one(judged, best, lead, i),
            replication=judged.replication(group, i),
        )
        for i, system in enumerate(e.systems)
    )
    return Component(
        name=lead if len(group) == 1 else FAMILY[lead],
        kind=Kind.ARTEFACT if lead in MEASUREMENT else Kind.MECHANISM,
        family=FAMILY[lead],
        members=members,
        inclusion_probability=probability,
        ablation_loss=share,
        heldout_gain=gain,
        parameters=() if best is None else _of_all(judged, best, lead),
        not_separable_from=tuple(rivals),
        by_fibre=by_fibre,
        log_odds=min(max(judged.averages.log_odds(group), -MOST_LOG_ODDS), MOST_LOG_ODDS),
        contribution_f0=judged.averages.contribution_f0(group),
    )


def _of_one(judged: Judged, names: Names, name: Name, i: int) -> tuple[Parameter, ...]:
    """A name's parameters in one fibre."""
    fit = judged.explorer.fits[names][i]
    problem = judged.explorer.systems[i].problem(names, fit.values)
    wanted = (name,) if name in MEASUREMENT else CATALOGUE[name].parameters
    rows = []
    for c in problem.coordinates:
        if c.name in wanted:
            value, z = fit.values[c.label], c.inward(fit.values[c.label])
            rows.append(Parameter(c.label, _unit(c), value, _interval(c, z, fit.sds[c.label]), at_bound(c, z)))
    return tuple(rows)


def _of_all(judged: Judged, names: Names, name: Name) -> tuple[Parameter, ...]:
    """A name's parameters over all fibres: the centre of their distribution."""
    e = judged.explorer
    if len(e.systems) == 1:
        return _of_one(judged, names, name, 0)
    if name in MEASUREMENT:
        # Each fibre's recordings have errors of their own.
        own = [(s.fibre.name, p) for i, s in enumerate(e.systems) for p in _of_one(judged, names, name, i)]
        return tuple(replace(p, name=f"{p.name} of {fibre}") for fibre, p in own)
    rows = []
    estimates = e.estimates(names)
    coordinates = {c.label: c for c in e.systems[0].problem(names, e.fits[names][0].values).coordinates}
    for label in CATALOGUE[name].parameters:
        c, d = coordinates[label], distribution(estimates[label])
        # On a logarithmic scale the spread is that around the centre.
        value = c.outward(d.mean)
        spread = value * float(np.expm1(d.spread)) if c.log else d.spread
        rows.append(Parameter(label, _unit(c), value, _interval(c, d.mean, d.se), False, spread))
    return tuple(rows)


def _interval(c: Coordinate, z: float, sd: float) -> tuple[float, float]:
    """Of a normal posterior, within the coordinate's bounds."""
    low, high = (c.outward(max(min(z + x * sd, c.inward(c.upper)), c.inward(c.lower))) for x in (-_NORMAL, _NORMAL))
    return low, high


def _unit(c: Coordinate) -> str:
    return ARTEFACTS_BY_NAME[c.name].unit if c.group is not None else PARAMETERS[c.name].unit


def answer_of(found: Sequence[Component]) -> tuple[str, ...]:
    """Mechanisms of the answer, best first: of a family whose members are not separable its likeliest one."""
    return tuple(c.members[0] for c in found if c.kind is Kind.MECHANISM and c.inclusion_probability >= NAMED)


def verdict_of(found: Sequence[Component], described: bool, detected: bool, fine: bool) -> Verdict:
    """What the diagnosis says as a whole.

    Args:
        described: whether the base describes the recordings at all.
        detected: whether the base leaves more than noise and the practical floor.
        fine: whether the fibre file as given is as good as the base fitted anew.
    """
    mechanisms = [c for c in found if c.kind is Kind.MECHANISM and c.inclusion_probability >= NAMED]
    artefacts = [c for c in found if c.kind is Kind.ARTEFACT and c.inclusion_probability >= NAMED]
    if not described:
        return Verdict.UNEXPLAINED
    if any(_sure(c) for c in mechanisms):
        return Verdict.PHYSICS
    if mechanisms:
        return Verdict.AMBIGUOUS
    if artefacts:
        return Verdict.MEASUREMENT
    if not detected:
        return Verdict.NONE if fine else Verdict.PARAMETERS
    return Verdict.UNEXPLAINED


def _sure(c: Component) -> bool:
    return c.inclusion_probability >= SURE and c.heldout_gain is not None and c.heldout_gain.beyond_error
