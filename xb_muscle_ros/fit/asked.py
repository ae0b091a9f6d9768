"""What a user asks of a fit: fibre to start from, nuisance parameters, bounds and priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Choice, free_names, population_choices
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.ordinary import shown_by
from xb_muscle_ros.fit.start import begun, with_constants
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.trials.trial import Trial


def starting_fibre(
    given: Fibre,
    trials: Sequence[Trial],
    free: Sequence[str] | None,
    fix: Sequence[str],
    ties: Mapping[str, str],
    kept: Mapping[str, float],
    features_of: str | None,
) -> tuple[Fibre, list[str]]:
    """The fibre to start from, with name and constants of the one that was measured, and lines on these."""
    fibre, lines = with_constants(begun(given, free, fix, ties, kept), [t.facts for t in trials])
    return replace(fibre, name=trials[0].facts.fibre if trials else features_of or fibre.name), lines


def nuisances_of(
    given: Sequence[str] | None, training: Sequence[FitTrial]
) -> tuple[list[str], dict[str, float], list[str]]:
    """Names of artefacts, standard deviations of those that the user gave one, and lines on what is left out.

    Raises:
        UserError: an SD of a whole set, one given twice, or ``none`` beside others.
    """
    ordinary, unseen = shown_by(training)
    sets: dict[str, Sequence[str]] = {"all": tuple(ARTEFACTS), "ordinary": ordinary, "none": ()}
    names: list[str] = []
    sds: dict[str, float] = {}
    for text in ["ordinary"] if given is None else given:
        name, equals, sd = text.partition("=")
        if name in sets and equals:
            raise UserError(
                f"--nuisance {text}: '{name}' takes no SD, since each has its own unit; name them one by one"
            )
        if name == "none" and given is not None and len(given) > 1:
            raise UserError("--nuisance none is given with others; give it alone")
        if name in sds:
            raise UserError(f"--nuisance {name} is given an SD twice; give it once")
        names += sets.get(name, (name,))
        if equals:
            sds[name] = number(sd, f"--nuisance {name}")
    left = [name for name in unseen if name not in names]
    asked = given is None or "ordinary" in given
    lines = (
        [f"not fitted, since nothing in the trials shows it: {', '.join(left)}"] if asked and left and training else []
    )
    return names, sds, lines


def choices_of(bound: Mapping[str, tuple[float, float]], prior: Mapping[str, tuple[float, float]]) -> dict[str, Choice]:
    """Bounds and priors (mean and SD) by parameter, in its unit."""
    made = {name: Choice(lower=low, upper=high) for name, (low, high) in bound.items()}
    for name, (mean, sd) in prior.items():
        made[name] = replace(made.get(name, Choice()), prior_mean=mean, prior_sd=sd)
    return made


def with_population(
    fibre: Fibre,
    choices: Mapping[str, Choice],
    others: Sequence[str | Path],
    free: Sequence[str] | None,
    fix: Sequence[str],
    ties: Mapping[str, str],
) -> tuple[dict[str, Choice], list[str]]:
    """Choices with priors of what other fibres' sets are like, and a line on parameters of which they say nothing."""
    sets = [load_fibre(name, fibre.model, for_fit=True) for name in others]
    names = free_names(fibre, free, fix, ties)
    found = population_choices(sets, choices, names)
    default = [name for name in names if name not in found and name not in choices]
    return found, [f"--prior-fibers says nothing of {', '.join(default)}: default priors"] if default else []


def number(text: str, where: str) -> float:
    """A number from text.

    Raises:
        UserError: it is none.
    """
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: '{text}' is not a number") from None
    if value != value:
        raise UserError(f"{where}: '{text}' is not a number")
    return value
