"""Where a fit begins and what it leaves as it is: mechanisms without values, constants, parameters held."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from xb_muscle_ros.fit.coordinates import free_names
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.catalogue import mechanisms_of, starts_for, without_effect
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.trial import TrialFacts


def begun(
    fibre: Fibre,
    free: Sequence[str] | None,
    fixed: Sequence[str],
    ties: Mapping[str, str],
    given: Collection[str] = (),
) -> Fibre:
    """The fibre with mechanisms of zero effect started at the catalogue's values, as far as they are fitted.

    At zero effect nothing tells where a mechanism's other parameters should go, and a descent may rest there.

    Args:
        fibre: as read, for a fit (see `fibre_from_parameters`).
        free, fixed, ties: see `parameter_coordinates`.
        given: parameters that keep the value they have, since the user gave it.
    """
    names = set(free_names(fibre, free, fixed, ties)) - set(given)
    values, starts = dict(fibre.values), {n: v for n, v in fibre.starts.items() if n not in given}
    for entry in without_effect(fibre.model, fibre.values):
        if entry.effect in names:
            starts |= {n: v for n, v in starts_for(entry, fibre.values).items() if n in names}
    values |= {name: tried[0] for name, tried in starts.items()}
    return replace(fibre, values=MappingProxyType(values), starts=MappingProxyType(starts))


def with_constants(fibre: Fibre, facts: Sequence[TrialFacts]) -> tuple[Fibre, list[str]]:
    """The fibre with the rest length and isometric force of its trials, which its file has to carry.

    Args:
        fibre: its parameters are relative to both, and stay as they are.
        facts: of the trials; none leave the fibre as it is.

    Returns:
        the fibre, and a line for each constant that differs between trials.
    """
    lines = []
    made = {"reference_length_m": fibre.reference_length_m, "f0_n": fibre.f0_n}
    for name, unit in (("reference_length_m", "m"), ("f0_n", "N")):
        ranked = sorted((float(getattr(each, name)), each.trial) for each in facts)
        if not ranked:
            continue
        # One that was recorded, in the middle of them: a mean would belong to no trial.
        value, trial = ranked[(len(ranked) - 1) // 2]
        if ranked[0][0] != ranked[-1][0]:
            lines.append(
                f"{name} differs between the trials, {ranked[0][0]:g} to {ranked[-1][0]:g} {unit}; the fibre file "
                f"carries the median, {value:g} {unit} of trial {trial}"
            )
        made[name] = value
    return replace(fibre, reference_length_m=made["reference_length_m"], f0_n=made["f0_n"]), lines


def held(problem: Problem) -> dict[str, float]:
    """Parameters of model and method that are neither fitted nor tied, with their values."""
    moved = {c.name for c in problem.coordinates if c.group is None}
    return {n: v for n, v in problem.fibre.values.items() if n not in moved and n not in problem.ties}


def start_lines(fibre: Fibre) -> list[str]:
    """For each mechanism that starts from the catalogue, one line with the values."""
    lines = []
    for entry in mechanisms_of(fibre.model):
        named = [n for n in entry.starting_values(fibre.values)[0] if n in fibre.starts]
        if named:
            values = ", ".join(f"{name} {fibre.values[name]:g}" for name in named)
            lines.append(f"{entry.name} has no fitted values in the fibre file; starts from the catalogue's: {values}")
    return lines


def unfitted_nuisances(problem: Problem) -> list[str]:
    """Names of the measurement artefacts that are taken as absent."""
    fitted = {c.name for c in problem.coordinates if c.group is not None}
    return [name for name in ARTEFACTS if name not in fitted]


def null_lines(problem: Problem) -> list[str]:
    """For each mechanism whose effect is not fitted and exactly zero, one line."""
    moved = {c.name for c in problem.coordinates if c.group is None} | set(problem.ties)
    return [
        f"{e.name} is at its null value ({e.effect} 0) and not fitted, its effect is exactly zero; free {e.effect} or "
        f"give --set {e.effect}=VALUE"
        for e in without_effect(problem.fibre.model, problem.fibre.values)
        if e.effect not in moved
    ]
