"""What a fit may move: model parameters and faults of the measurement, each with scale, bounds and prior."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, Scope
from xb_muscle_ros.mechanisms import Entry
from xb_muscle_ros.models.catalogue import mechanisms_of
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.parameters import PARAMETERS

FITTED_BY_THE_PAPER = (
    "f", "k11", "k21", "k22", "dLcrit", "kon", "koop", "kappa", "n", "JF", "vmax", "kse", "kse0", "kpe", "Fpe0",
)  # fmt: skip
"""Over all its models (van der Zee et al. 2026, "Fitted model parameters"): those that its AIC counts."""
# And what the paper does not name: a sigmoid's activation at full calcium, of which every released set has its own; the
# shape of a soft parallel spring: where it stays as it starts, a fit makes a measurement artefact of what the spring
# gets wrong.
FITTED = (*FITTED_BY_THE_PAPER, "act_max", "lpe0", "pe_sharpness")
# How far a fit may go from its start where nothing else is said: a factor either way.
REACH = 100.0
# Default prior on a logarithmic scale: two thirds within a factor of e of the start, as wide as the released sets of
# seven fibres differ, or wider; on a linear scale the start itself is the standard deviation. Without any prior,
# cooperativity runs off to where force jumps between two steady states, and a fit can park a trial on the edge of it.
PRIOR_LOG_SD = 1.0
# Fibres of one study resemble each other more than the next one will.
LEAST_POPULATION_LOG_SD = 0.2


@dataclass(frozen=True)
class Coordinate:
    """One number that a fit moves.

    Attributes:
        name: of the parameter or fault.
        group: of a fault: the trial or solution whose own it is, or empty; None for a model parameter.
        log: whether it is moved on a logarithmic scale.
        lower, upper: bounds, in its unit.
        start: where the first start begins.
        prior_mean, prior_sd: normal prior on the moved scale (natural logarithm where `log`); sd inf: none.
        others: where further starts begin in turn, in its unit; empty: around the first.
    """

    name: str
    group: str | None
    log: bool
    lower: float
    upper: float
    start: float
    prior_mean: float
    prior_sd: float
    others: tuple[float, ...] = ()

    @property
    def label(self) -> str:
        """Name, with the group in brackets."""
        return f"{self.name}[{self.group}]" if self.group else self.name

    def inward(self, value: float) -> float:
        """A value on the moved scale."""
        return math.log(value) if self.log else value

    def outward(self, moved: float) -> float:
        """A value in its unit."""
        return math.exp(moved) if self.log else moved


@dataclass(frozen=True)
class Choice:
    """What the user says about one model parameter; None: the default.

    Attributes:
        lower, upper: bounds, in its unit.
        prior_mean, prior_sd: in its unit; sd as a factor minus 1 on a logarithmic scale (0.2: 20 %); inf: no prior.
    """

    lower: float | None = None
    upper: float | None = None
    prior_mean: float | None = None
    prior_sd: float | None = None


def free_names(
    fibre: Fibre, free: Sequence[str] | None, fixed: Sequence[str], ties: Mapping[str, str]
) -> tuple[str, ...]:
    """Names of the parameters that are moved.

    Args:
        free: names to move; None: those that the paper fitted, and those of the model's mechanisms.
        fixed, ties: see `parameter_coordinates`.
    """
    own = [name for entry in mechanisms_of(fibre.model) for name in entry.parameters]
    wanted = dict.fromkeys((*FITTED, *own) if free is None else free)
    return tuple(n for n in wanted if n in fibre.values and n not in fixed and n not in ties)


def parameter_coordinates(
    fibre: Fibre,
    free: Sequence[str] | None,
    fixed: Sequence[str],
    ties: Mapping[str, str],
    choices: Mapping[str, Choice],
) -> tuple[Coordinate, ...]:
    """Coordinates of a model's parameters.

    Args:
        fibre: start values, model and method.
        free: see `free_names`.
        ties: name -> name whose value it takes.
        choices: bounds and priors by name.

    Raises:
        UserError: a name the model does not have; bounds that are crossed, beyond the parameter's range or off its
            start; a bound or prior of a parameter that is not moved.
    """
    for name in (*(free or ()), *fixed, *ties, *ties.values(), *choices):
        if name not in fibre.values or name not in PARAMETERS:
            raise UserError(f"model {fibre.model} has no parameter '{name}'{suggest(name, fibre.values)}")
    names = free_names(fibre, free, fixed, ties)
    for name in choices:
        if name not in names:
            raise UserError(f"parameter '{name}' has a bound or prior but is not fitted; add it to --free")
    for tied, source in ties.items():
        if source in ties:
            raise UserError(f"parameter '{tied}' is tied to '{source}', which is tied itself; tie both to a third one")
    owners = {name: entry for entry in mechanisms_of(fibre.model) for name in entry.parameters}
    return tuple(_parameter(fibre, name, owners.get(name), choices.get(name, Choice())) for name in names)


def mechanism_coordinates(entry: Entry, values: Mapping[str, float]) -> tuple[Coordinate, ...]:
    """Coordinates of a mechanism's parameters, started at some values.

    The effect is moved on a linear scale, so that its interval can hold 0.
    """
    return tuple(_of_mechanism(entry, name, float(values[name])) for name in entry.parameters)


def _of_mechanism(entry: Entry, name: str, start: float) -> Coordinate:
    row = PARAMETERS[name]
    if name == entry.effect:
        lower = max(row.lower, -entry.reach * entry.size) if row.lower < 0.0 else 0.0
        upper = min(row.upper, entry.reach * entry.size)
        return Coordinate(name, None, False, lower, upper, start, 0.0, entry.size)
    sd = entry.shape[name]
    if row.lower < 0.0:
        low, high = max(row.lower, start - 4.0 * sd), min(row.upper, start + 4.0 * sd)
        return Coordinate(name, None, False, low, high, start, start, sd)
    low = max(row.lower, start * math.exp(-3.0 * sd), 1e-12)
    high = min(row.upper, start * math.exp(3.0 * sd))
    return Coordinate(name, None, True, low, high, start, math.log(start), sd)


def _of_paper(name: str, start: float) -> Coordinate:
    """A parameter that no mechanism of the model's name brings."""
    row = PARAMETERS[name]
    log = row.lower >= 0.0 and start > 0.0
    lower = max(row.lower, start / REACH) if log else row.lower
    upper = min(row.upper, start * REACH) if log else row.upper
    if log:
        return Coordinate(name, None, True, lower, upper, start, math.log(start), PRIOR_LOG_SD)
    return Coordinate(name, None, False, lower, upper, start, start, abs(start) or math.inf)


def _parameter(fibre: Fibre, name: str, owner: Entry | None, choice: Choice) -> Coordinate:
    row, start = PARAMETERS[name], float(fibre.values[name])
    # A shape of 0, such as a ratio that leaves one arm alone, has no logarithm to move.
    ours = owner is not None and (name == owner.effect or start > 0.0 or row.lower < 0.0)
    made = _of_mechanism(owner, name, start) if owner is not None and ours else _of_paper(name, start)
    log = made.log
    starts = fibre.starts.get(name, (start,))
    # A value beyond the usual reach has the table's range to move in.
    lower = made.lower if made.lower <= min(starts) else max(row.lower, 1e-12) if log else row.lower
    upper = made.upper if made.upper >= max(starts) else row.upper
    lower = lower if choice.lower is None else choice.lower
    upper = upper if choice.upper is None else choice.upper
    where = f"parameter '{name}'"
    if not row.lower <= lower < upper <= row.upper:
        raise UserError(
            f"{where}: bounds {lower:g} to {upper:g} {row.unit}; allowed are bounds in order within "
            f"{row.lower:g} to {row.upper:g}"
        )
    if log and lower <= 0.0:
        raise UserError(f"{where}: lower bound {lower:g} on a logarithmic scale; give one above 0")
    if not lower <= start <= upper:
        raise UserError(
            f"{where}: starts at {start:g} {row.unit}, outside its bounds {lower:g} to {upper:g}; widen them, or "
            "start from another fibre file"
        )
    mean = choice.prior_mean
    if mean is not None and log and mean <= 0.0:
        raise UserError(f"{where}: prior mean {mean:g}; needed is one above 0 on a logarithmic scale")
    sd = choice.prior_sd
    if sd is not None and not sd > 0.0:
        raise UserError(f"{where}: prior sd {sd:g}; needed is an sd above 0")
    others = tuple(min(max(value, lower), upper) for value in starts[1:])
    # A prior favours none of the places where the fit may begin; that of an effect is about its absence.
    middle = sum(made.inward(value) for value in starts) / len(starts) if others and ours else made.prior_mean
    default = made.prior_mean if owner is not None and name == owner.effect else middle
    return replace(
        made,
        lower=lower,
        upper=upper,
        prior_mean=default if mean is None else math.log(mean) if log else mean,
        prior_sd=made.prior_sd if sd is None else math.log1p(sd) if log else sd,
        others=others,
    )


def population_choices(
    fibres: Sequence[Fibre], choices: Mapping[str, Choice], names: Sequence[str] = FITTED
) -> dict[str, Choice]:
    """Priors from what a parameter is in other fibres, for those whose prior nobody chose.

    Args:
        fibres: of the model that is fitted; at least three, each with its own values.
        choices: of the user, which stay.
        names: of the parameters that are fitted; those that the paper did not fit keep their default priors.

    Raises:
        UserError: too few fibres.
    """
    if len(fibres) < 3:
        raise UserError(f"priors from {len(fibres)} fibres; at least 3 are needed to know how fibres differ")
    made = dict(choices)
    for name in (n for n in FITTED if n in names):
        values = [fibre.values[name] for fibre in fibres if name in fibre.values]
        if len(values) < len(fibres) or min(values) <= 0.0 or made.get(name, Choice()).prior_mean is not None:
            continue
        logs = np.log(values)
        # A new fibre differs from the mean of n by the spread and by the mean's own error.
        sd = max(float(np.std(logs, ddof=1)) * math.sqrt(1.0 + 1.0 / len(values)), LEAST_POPULATION_LOG_SD)
        mean = float(np.exp(np.mean(logs)))
        made[name] = replace(made.get(name, Choice()), prior_mean=mean, prior_sd=math.expm1(sd))
    return made


def fault_coordinates(
    names: Sequence[str], trials: Sequence[str], solutions: Sequence[str], sds: Mapping[str, float]
) -> tuple[Coordinate, ...]:
    """Coordinates of faults, one for each trial, solution or study that has its own value.

    Args:
        names: of `ARTEFACTS`.
        trials, solutions: names of the trials, and of the solution of each.
        sds: standard deviations that replace those of the table.

    Raises:
        UserError: a name that is no fault, or an sd that is not above 0.
    """
    found = []
    for name in dict.fromkeys(names):
        if name not in ARTEFACTS:
            raise UserError(f"measurement fault '{name}' is not known{suggest(name, ARTEFACTS)}")
        row = ARTEFACTS[name]
        sd = sds.get(name, row.sd)
        if not sd > 0.0:
            unit = "" if row.unit == "1" else f" {row.unit}"
            raise UserError(f"measurement fault '{name}': sd {sd:g}{unit}; allowed is above 0")
        groups = {Scope.TRIAL: trials, Scope.SOLUTION: solutions, Scope.STUDY: ("",)}[row.scope]
        found += [Coordinate(name, g, False, row.lower, row.upper, 0.0, 0.0, sd) for g in dict.fromkeys(groups)]
    return tuple(found)
