"""What a protocol is: trials that it makes, what a model answers to them, and what is read off the answers.

One module for each protocol, named in `registry`. The same analysis runs on recordings and on simulated trials.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, naming, suggest
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.standard_error import ForceNoise, force_noise
from xb_muscle_ros.simulation.offline import as_simulated, simulate_trial
from xb_muscle_ros.trials.protocol import Allowed
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Array, Trial

MEASURED = "measured"


class NoAnswer(UserError):
    """A model has no answer to a trial; it may have one to others."""


Cell = Estimate | float | str | None


@dataclass(frozen=True)
class Option:
    """A number, or several, that a protocol may be given.

    Attributes:
        name: with hyphens: ``--name`` on the command line.
        default: one or several numbers.
        allowed: range and unit.
        help: for the command line, without default and range.
        many: several may be given; each makes trials.
    """

    name: str
    default: tuple[float, ...]
    allowed: Allowed
    help: str
    many: bool = True


Settings = Mapping[str, tuple[float, ...]]
"""Numbers by the names of a protocol's options."""


class Column(NamedTuple):
    """How a quantity is shown.

    Attributes:
        text: its name, without unit.
        unit: empty for none.
        form: format of the number.
        factor: the number times this is shown, in `unit`; files hold the number as its key says.
    """

    text: str
    unit: str = ""
    form: str = ".3g"
    factor: float = 1.0

    @property
    def head(self) -> str:
        """Name and unit."""
        return f"{self.text} ({self.unit})" if self.unit else self.text


class Number(NamedTuple):
    """A number that a whole protocol gives.

    Attributes:
        value: None where there is none.
        se: standard error; None where it is not known.
        low, high: 95 % interval; None where it is not known or has no end.
        why: why there is no value or no interval; empty where there is nothing to say.
    """

    value: float | None
    se: float | None = None
    low: float | None = None
    high: float | None = None
    why: str = ""


@dataclass(frozen=True)
class Planned:
    """A trial to be made.

    Attributes:
        trial: length, calcium, phases and facts, among them the protocol and its settings; without force.
        corner_s, corner_l0: shape (m,), s and L0; where length is straight between few corners, so that a model goes
            from one to the next by variable steps. Empty where it goes from sample to sample.
        load: shape (n,), over the isometric force at the first sample, where length answers to it; else empty.
    """

    trial: Trial
    corner_s: Array = field(default_factory=lambda: np.empty(0))
    corner_l0: Array = field(default_factory=lambda: np.empty(0))
    load: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class Run:
    """A trial with its force, measured or of a model.

    Attributes:
        trial: length and calcium; where a protocol gives the load, the length that answered.
        time_s, force_f0: shape (n,), s and F0.
        noise: of a measured force; None for a model's, and where its quiet times do not tell it.
        simulated: what the model answered; None for a recording.
    """

    trial: Trial
    time_s: Array
    force_f0: Array
    noise: ForceNoise | None = None
    simulated: Simulated | None = None

    @property
    def length_l0(self) -> Array:
        """Length change at the samples of force, L0, shape (n,)."""
        length: Array = np.interp(self.time_s, self.trial.time_s, self.trial.length_change_l0)
        return length

    def setting(self, name: str) -> float | None:
        """What the protocol was given for this trial; None where the trial does not tell."""
        return self.trial.facts.setting(name)


class Curve(NamedTuple):
    """A line of a figure that is fitted or simulated, shape (n,) each."""

    x: Array
    y: Array


@dataclass(frozen=True)
class Found:
    """What a protocol shows of one fibre, measured or by one model.

    Attributes:
        fibre: name.
        of: `MEASURED`, or the model's parameter set.
        rows: a table; keys are those of `Protocol.columns`.
        numbers: what the whole table gives; keys are those of `Protocol.numbers`.
        curves: fitted curves, for the figure.
        runs: what it was read off.
        notes: what is missing, and what was taken for granted, one line each.
        parts: a table of the parts of trials; keys are those of `Protocol.part_columns`.
        numbers_at: where each of several conditions gives numbers of its own, those by the condition's name, for
            example ``pCa 6.1``; `numbers` are then those of the first.
    """

    fibre: str
    of: str
    rows: tuple[Mapping[str, Cell], ...]
    numbers: Mapping[str, Number] = field(default_factory=dict)
    curves: Mapping[str, Curve] = field(default_factory=dict)
    runs: tuple[Run, ...] = ()
    notes: tuple[str, ...] = ()
    numbers_at: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    parts: tuple[Mapping[str, Cell], ...] = ()

    def column(self, key: str) -> Array:
        """Numbers of a column, NaN where there is none, shape (rows,)."""
        cells = [row.get(key) for row in self.rows]
        values = [cell.value if isinstance(cell, Estimate) else cell for cell in cells]
        return np.array([np.nan if value is None or isinstance(value, str) else value for value in values], dtype=float)

    def errors(self, key: str) -> Array:
        """Standard errors of a column, NaN where there is none, shape (rows,)."""
        cells = [row.get(key) for row in self.rows]
        found = [cell.se if isinstance(cell, Estimate) else None for cell in cells]
        return np.array([np.nan if se is None else se for se in found], dtype=float)


class Protocol(abc.ABC):
    """One protocol.

    Attributes:
        name: with hyphens.
        title: what it is, in a few words.
        options: what it may be given.
        columns: of its table: key with unit -> how it is shown.
        numbers: what the whole table gives: key with unit -> how it is shown.
        part: what several of make a trial, for a table of all of them (``cycle``); empty for no such table.
        part_columns: of that table.
        source: a reference to the method.
    """

    name: str
    title: str
    options: tuple[Option, ...]
    columns: Mapping[str, Column]
    numbers: Mapping[str, Column] = MappingProxyType({})
    part: str = ""
    part_columns: Mapping[str, Column] = MappingProxyType({})
    source: str = ""

    @abc.abstractmethod
    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """Trials to make, in normalised units (1 m is L0, 1 N is F0).

        Raises:
            UserError: settings against each other; each alone is checked already.
        """

    def answer(self, muscle: Muscle, planned: Planned, settle_s: float | None = None) -> Run:
        """What a model answers to a planned trial.

        Args:
            settle_s: isometric time before it, s; None: until at rest.

        Raises:
            UserError, StateViolation: see `simulate_trial`; names the trial.
        """
        trial, corner_s = planned.trial, planned.corner_s
        if not corner_s.size:
            return run_of(trial, simulate_trial(muscle, trial, 1, settle_s))
        level = float(trial.calcium_um[0])
        with naming(f"trial {trial.facts.trial}"):
            state = muscle.settle(float(planned.corner_l0[0]), level, settle_s)
            held = np.full(corner_s.size, level)
            states = muscle.follow(state, corner_s, planned.corner_l0, held, trial.time_s)
        return run_of(trial, as_simulated(trial, trial.time_s, muscle.outputs_of(states)))

    def answered(self, planned: Planned, simulated: Simulated, length_m: Array | None = None) -> Run:
        """What something else answered to a planned trial, sample by sample; `length_m` to loads, shape (n,), m."""
        return run_of(planned.trial if length_m is None else replace(planned.trial, length_m=length_m), simulated)

    def repeat(self, muscle: Muscle, trial: Trial, settle_s: float | None = None) -> Run:
        """What a model answers to what a recorded fibre was given: its length and calcium, unless a protocol differs.

        Raises:
            UserError, StateViolation: see `simulate_trial`; names the trial.
        """
        return run_of(trial, simulate_trial(muscle, trial, 1, settle_s))

    @abc.abstractmethod
    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Read the table and the numbers off the runs of one fibre. What cannot be read is a note, not an error."""

    @abc.abstractmethod
    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Draw what was found of one fibre, measured and by models, into an empty figure (of `size_mm`)."""

    def size_mm(self, found: Sequence[Found]) -> tuple[float, float]:
        """Width and height of the figure, mm."""
        return 170.0, 75.0


def run_of(trial: Trial, simulated: Simulated) -> Run:
    """A model's answer as a run."""
    return Run(trial, simulated.time_s, simulated.force_n / trial.facts.f0_n, None, simulated)


def measured(trial: Trial) -> Run:
    """A recording as a run."""
    return Run(trial, trial.force_time_s, trial.measured_f0, force_noise(trial))


def settings_of(protocol: Protocol, given: Mapping[str, Any]) -> Settings:
    """Settings of a protocol, with its defaults where nothing is given.

    Args:
        given: a number or several by name of the option, with hyphens or underscores; None: the default.

    Raises:
        UserError: the protocol has no such option, a number is out of range, or there are several where one is needed.
    """
    options = {option.name: option for option in protocol.options}
    settings = {option.name: option.default for option in protocol.options}
    for key, value in given.items():
        name = key.replace("_", "-")
        if value is None:
            continue
        if name not in options:
            raise UserError(f"protocol {protocol.name} has no option '{name}'{suggest(name, options)}")
        numbers = tuple(float(number) for number in np.atleast_1d(np.asarray(value, dtype=np.float64)))
        if not numbers or (len(numbers) > 1 and not options[name].many):
            raise UserError(f"--{name} has {len(numbers)} numbers; protocol {protocol.name} takes one")
        for number in numbers:
            options[name].allowed.check(f"--{name}", number)
        settings[name] = numbers
    return settings
