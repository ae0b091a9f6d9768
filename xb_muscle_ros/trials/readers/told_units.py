"""Units and columns that a file tells of its channels, as `left_out.Told`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.left_out import Told
from xb_muscle_ros.trials.readers.units import KINDS, UNITS, calibration, unit_in, unit_of, volts_of


def told_unit(text: str, signal: str, where: str) -> str:
    """The unit of a signal that a file tells, as a mapping spells it.

    Args:
        signal: one of `columns.SIGNALS`.
        where: the file and the column, for messages.

    Raises:
        UserError: it is not known, or none of such a signal.
    """
    unit = unit_in(text, signal)
    if unit is not None:
        return unit
    option = f"--{signal}-unit" if signal in KINDS and signal != "stimulation" else f"columns.{signal}.unit"
    try:
        unit_of(text, signal, where)
    except UserError as problem:
        raise UserError(f"{problem} (the file says so); give {option} if it is another") from None
    return text


def differing(where: str, units: Mapping[str, str], mapping: ImportMapping) -> Iterator[str]:
    """Lines on units of a mapping that are others than the file's.

    Args:
        where: the file.
        units: as the file has them, by signal; empty for none.
    """
    for key, unit in units.items():
        column = mapping.columns[key]
        known = unit_in(unit, key) if unit else None
        volts = volts_of(unit, key) if unit else ""
        if volts and volts != column.unit.per:
            yield (
                f"{where}: the file says {unit} of {key}, the mapping {column.unit_name}; the mapping's is used; by "
                f"columns.{key}.unit (--{key}-unit) give {calibration(key, volts)}"
            )
        elif unit and not volts and (known is None or UNITS[known] != column.unit):
            yield f"{where}: the file says {unit} of {key}, the mapping {column.unit_name}; the mapping's is used"


def told_of(where: str, columns: dict[str, str], units: dict[str, str]) -> Told:
    """Columns and units that a file tells, by signal, with a line on the units."""
    values = [(f"columns.{key}.column", name) for key, name in columns.items()]
    values += [(f"columns.{key}.unit", unit) for key, unit in units.items()]
    line = f"{where}: units are those of the file: {', '.join(f'{key} in {unit}' for key, unit in units.items())}"
    return Told(tuple(values), (line,) if units else ())
