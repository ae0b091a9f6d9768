"""What has to be known of a data set's files to make trials of them; `mapping` makes it of a mapping file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.readers.options import DEFAULTS, TableOptions
from xb_muscle_ros.trials.readers.units import Quantity, Unit, finite

# What a length may be the length of, the first by default.
LENGTHS_OF = ("fibre", "half_sarcomere", "sarcomere")
# A reference length that is no number: the length before the first stretch.
FIRST_ISOMETRIC = "first_isometric"
FACTS = ("pca", "amplitude_l0", "recovery_s")
# Endings of files that tell a format and are no part of a name.
ENDINGS = (
    *(".csv", ".tsv", ".txt", ".dat", ".asc", ".lvm", ".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"),
    *(".mat", ".slc", ".abf", ".ddf", ".sto", ".mot", ".mcap", ".db3"),
)


class Column(NamedTuple):
    """Where the numbers of a signal are, a column, a channel or a field of a topic's messages, and their unit.

    With a ``pattern`` they are in a column for each trial, whose whole name it matches; ``name`` is then the pattern's
    text, and numbers that its groups find are multiplied with ``factors``.
    """

    name: str
    unit_name: str
    unit: Unit
    field: str = ""
    pattern: re.Pattern[str] | None = None
    factors: Mapping[str, float] = {}


class Stimulation(NamedTuple):
    """A record of stimulation: on above ``threshold`` (V or 1); gaps up to ``pulse_gap_s`` belong to one tetanus."""

    column: Column
    threshold: float
    pulse_gap_s: float


class Activation(NamedTuple):
    """How stimulation becomes calcium, and when there is any where no column tells.

    Attributes:
        transient: levels and time constants.
        source: where these come from, in words.
        begin_s: begin of stimulation, s; None where a column tells, infinity where there is none.
        end_s: its end, s; None for the sharp drop of force.
    """

    transient: CalciumTransient
    source: str = ""
    begin_s: float | None = None
    end_s: float | None = None


@dataclass(frozen=True, eq=False)
class ImportMapping:
    """Everything that has to be known to make trials of one or more files.

    Attributes:
        where: the mapping file or the command line, for messages.
        fibre: name of the fibre; ``{file}`` and ``{folder}`` stand for the names of the file and its folder.
        data_set: begins the names of the bags; the fibre's name where it is not given; ``{folder}`` as in ``fibre``.
        source: where the data come from, in words.
        time, length: columns every file has.
        force, calcium: columns a file may have.
        stimulation: a column of stimulation a file may have.
        activation: makes calcium of stimulation.
        trial: name of the trial, with ``{file}`` and ``{folder}`` as in ``fibre``.
        trial_column: a column of a table whose value tells its trials apart; None for one called so, if any.
        table: how a table is read.
        told: lines on what was taken from the file because the mapping leaves it out.
        rate_hz: samples in a second, where there is no column of time.
        length_is_change: the length column holds the change from the reference length.
        length_of: what the length column is the length of, one of `LENGTHS_OF`; lengths of sarcomeres and halves of
            them are stored relative to L0 = 1 m.
        reference_length: the length that is L0; None for the mean of the first isometric samples, or 1 m where
            lengths are in L0.
        at_reference: what the length column reads where the fibre has its reference length; None for that length.
        largest_step_s: samples may be this far apart, s; None for what a muscle's record usually has.
        servo_give: length changes up to this that come back are none: the motor gave under the muscle's force.
        f0: the force or stress that is F0; None for 1 N where forces are in F0.
        f0_at_pca: F0 is the initial isometric force of the trial at this pCa in the same folder; None where not.
        f0_note: where F0 comes from, where that was found out rather than given.
        force_zero_from_slack: force is zero while the fibre is slack after a release.
        force_zero: what the force column reads where there is no force; None for zero.
        notch_hz: frequencies that are taken out of length and force, Hz.
        facts: those of `FACTS` that hold for every file (-log10 M, L0, s).
        file_name: finds facts in file names by its groups ``pca``, ``amplitude_l0``, ``recovery_s``.
        factors: what a number found in the file name is multiplied with.
        isometric_fractions: isometric force of the matching isometric trials by pCa, F0; may be empty.
        isometric_source: where these come from.
        gear_ratio: of a lever between motor and muscle; length is divided by it, force multiplied with it.
        reference_note: where the reference length comes from.
        own_keys: keys the mapping itself has, dotted as ``columns.force.unit``, rather than the reader for it.
        sure: those of `FACTS` that an option gives, which hold whatever the name of a file tells.
    """

    where: str
    fibre: str
    data_set: str
    source: str
    time: Column
    length: Column
    force: Column | None = None
    calcium: Column | None = None
    stimulation: Stimulation | None = None
    activation: Activation | None = None
    trial: str = "{file}"
    trial_column: str | None = None
    table: TableOptions = DEFAULTS
    told: tuple[str, ...] = ()
    rate_hz: float | None = None
    length_is_change: bool = False
    length_of: str = "fibre"
    reference_length: Quantity | None = None
    at_reference: Quantity | None = None
    largest_step_s: float | None = None
    servo_give: Quantity | None = None
    f0: Quantity | None = None
    f0_at_pca: float | None = None
    f0_note: str = ""
    force_zero_from_slack: bool = False
    force_zero: Quantity | None = None
    notch_hz: tuple[float, ...] = ()
    facts: Mapping[str, float] = field(default_factory=dict)
    file_name: re.Pattern[str] | None = None
    factors: Mapping[str, float] = field(default_factory=dict)
    isometric_fractions: Mapping[float, float] = field(default_factory=dict)
    isometric_source: str = ""
    gear_ratio: float | None = None
    reference_note: str = "given"
    own_keys: frozenset[str] = frozenset()
    sure: frozenset[str] = frozenset()

    @property
    def l0_is_a_length(self) -> bool:
        """Whether L0 is so many metres, rather than what a record in L0 counts in: bags hold 1 m for that."""
        told_m = None if self.reference_length is None else self.reference_length.value
        return self.length.unit.kind == "length" or told_m not in (None, 1.0)

    @property
    def columns(self) -> dict[str, Column]:
        """Where each signal is, by its name."""
        stimulation = None if self.stimulation is None else self.stimulation.column
        told = {"time": self.time, "length": self.length, "force": self.force, "calcium": self.calcium}
        return {name: column for name, column in {**told, "stimulation": stimulation}.items() if column is not None}

    @property
    def patterns(self) -> tuple[re.Pattern[str], ...]:
        """Patterns whose groups tell facts: of the names of files, sheets and columns."""
        sheets = None if self.table.sheets is None else self.table.sheets.pattern
        found = (self.file_name, sheets, *(column.pattern for column in self.columns.values()))
        return tuple(pattern for pattern in found if pattern is not None)

    def facts_of(self, path: Path) -> dict[str, float | None]:
        """pCa, amplitude (L0) and recovery (s) of one file.

        What its name tells goes before what the mapping tells for all, and what an option tells goes before both.

        Raises:
            UserError: the file name does not match the pattern.
        """
        named = self.named(path)
        told = {name: value for name, value in named.items() if name not in self.sure}
        return {name: told.get(name, self.facts.get(name)) for name in FACTS}

    def named(self, path: Path) -> dict[str, float]:
        """What the name of a file tells.

        Raises:
            UserError: it does not match the pattern.
        """
        if self.file_name is None:
            return {}
        match = self.file_name.search(name_of(path))
        if match is None:
            raise UserError(
                f"{path}: the file name does not match '{self.file_name.pattern}' of {self.where}; "
                "use the mapping made for this file"
            )
        return {
            name: fact_of(text, self.factors.get(name, 1.0), name, str(path))
            for name, text in match.groupdict().items()
            if text is not None
        }


def fact_of(text: str, factor: float, name: str, where: str) -> float:
    """A fact that a name tells, with a decimal point or comma, to 12 digits, so that 61 tenths are 6.1.

    Raises:
        UserError: it is no finite number.
    """
    return float(f"{finite(text.replace(',', '.'), name, where) * factor:.12g}")


def name_of(path: Path) -> str:
    """Name of a recording: that of the folder, or of the file without the ending that tells its format.

    Only known endings are cut, so that ``run_pCa6.0`` and ``run_pCa6.2`` keep theirs.
    """
    name = path.resolve().name if path.name in ("", ".", "..") else path.name
    return name[: -len(path.suffix)] if path.suffix.lower() in ENDINGS and not path.is_dir() else name


def filled(template: str, path: Path) -> str:
    """A name with ``{file}`` (see `name_of`) and ``{folder}`` put in."""
    return template.replace("{file}", name_of(path)).replace("{folder}", path.resolve().parent.name)
