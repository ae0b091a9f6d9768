"""The next experiment: from a menu of protocols the one that separates what is least sure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.names import MEASUREMENT
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

# Surer than this there is nothing to separate.
_SURE = 0.98
# Menu: speed and amplitude of a ramp, hold after it, length the fibre starts from.
_SPEEDS_L0_PER_S = (0.05, 0.5, 2.0)
_AMPLITUDES_L0 = (0.04, -0.04)
_LENGTHS_L0 = (0.0, 0.05)
_LEAD_S, _HOLD_S = 0.2, 1.0
_RATE_HZ = 1000.0


class Protocol(NamedTuple):
    """One entry of the menu: what is done in words, and its inputs as a trial without force."""

    words: str
    trial: Trial


class Proposal(NamedTuple):
    """What to record next, the components that it separates, and the root-mean-square by which they differ there."""

    protocol: Protocol
    separates: tuple[str, ...]
    difference_f0: float


def menu(fibre: str, pcas: Sequence[float]) -> list[Protocol]:
    """Ramps and holds at some pCa, fast and slow, up and down, from rest length and from a longer one."""
    grid = itertools.product(pcas, _LENGTHS_L0, _AMPLITUDES_L0, _SPEEDS_L0_PER_S)
    return [_ramp(fibre, *row) for row in grid]


def _ramp(fibre: str, pca: float, start_l0: float, amplitude_l0: float, speed: float) -> Protocol:
    ramp_s = abs(amplitude_l0) / speed
    corners_s = np.cumsum([0.0, _LEAD_S, ramp_s, _HOLD_S])
    corners_l0 = np.array([start_l0, start_l0, start_l0 + amplitude_l0, start_l0 + amplitude_l0])
    count = int(np.floor(corners_s[-1] * _RATE_HZ * (1.0 + 1e-12))) + 1
    time_s = np.round(np.arange(count) / _RATE_HZ * 1e9) / 1e9
    kind = "stretch" if amplitude_l0 > 0.0 else "shortening"
    phases = (
        Phase("isometric", 0.0, float(corners_s[1])),
        Phase(kind, float(corners_s[1]), float(corners_s[2])),
        Phase("hold" if amplitude_l0 > 0.0 else "recovery", float(corners_s[2]), float(corners_s[3])),
    )
    name = f"{kind}_{100 * abs(amplitude_l0):g}pct_{speed:g}_from_{100 * start_l0:g}pct_pca{10 * pca:g}"
    where = "rest length" if start_l0 == 0.0 else f"{100 * start_l0:g} % L0 beyond rest length"
    words = (
        f"a {kind} by {100 * abs(amplitude_l0):g} % L0 at {speed:g} L0/s from {where} at pCa {pca:g}, "
        f"then a hold for {_HOLD_S:g} s"
    )
    trial = Trial(
        TrialFacts(fibre=fibre, trial=name, pca=pca, phases=phases, source="proposed by xb_muscle diagnose"),
        time_s,
        1.0 + np.interp(time_s, corners_s, corners_l0),
        np.zeros(1),
        np.array([10.0 ** (6.0 - pca)]),
    )
    return Protocol(words, trial)


def propose(one: Fibre, other: Fibre, separates: Sequence[str], pcas: Sequence[float]) -> Proposal | None:
    """The protocol on which two models differ most; None where neither has a solution on any.

    Args:
        one, other: fitted fibres; measurement artefacts have no part in it, the next recording has its own.
        separates: names of the components in which they differ.
        pcas: at which solutions are at hand.
    """
    muscles = [Muscle(one), Muscle(other)]
    best: Proposal | None = None
    for protocol in menu(one.name, pcas):
        try:
            forces: list[Array] = [simulate_trial(muscle, protocol.trial).force_n for muscle in muscles]
        except UserError:
            continue
        apart = float(np.sqrt(np.mean((forces[0] - forces[1]) ** 2)))
        if best is None or apart > best.difference_f0:
            best = Proposal(protocol, tuple(separates), apart)
    return best


def plan(study: Searched, found: Sequence[Component]) -> Proposal | None:
    """The protocol on which the two most probable sets differ most that do not agree on the least sure mechanism."""
    sets = {s: study.explorer.evidence(s) for s in study.explorer.fits}
    for names, separates in _pairs(sets, found):
        one, other = (study.fibre_with(s, 0) for s in names)
        pcas = sorted({t.facts.pca for t in study.studies[0].trials if t.facts.pca is not None})
        chosen = sorted({pcas[0], pcas[len(pcas) // 2], pcas[-1]}) if pcas else [6.2]
        proposal = propose(one, other, separates, chosen)
        if proposal is not None:
            return proposal
    return None


def _pairs(sets: dict[Names, float], found: Sequence[Component]) -> list[tuple[tuple[Names, Names], tuple[str, ...]]]:
    """Pairs of sets to tell apart, the least sure component first."""
    unsure = sorted(
        (c for c in found if c.kind is Kind.MECHANISM and c.inclusion_probability > 1.0 - _SURE),
        key=lambda c: abs(c.inclusion_probability - 0.5),
    )
    pairs = []
    for c in unsure[:3]:
        members = c.members[:2]
        first, *others = ([s for s in sets if m in s] for m in members)
        second = others[0] if others else [s for s in sets if members[0] not in s]
        if not first or not second:
            continue
        best = max(first, key=lambda s: sets[s]), max(second, key=lambda s: sets[s])
        one, other = ([n for n in names if n not in MEASUREMENT] for names in best)
        if set(one) != set(other):
            instead = (n for n in other if n not in one)
            pairs.append((best, (*members, *instead)[:2]))
    return pairs


def scaled(trial: Trial, reference_length_m: float, f0_n: float) -> Trial:
    """The protocol in a fibre's own units."""
    facts = replace(trial.facts, reference_length_m=reference_length_m, f0_n=f0_n)
    return replace(trial, facts=facts, length_m=trial.length_m * reference_length_m)
