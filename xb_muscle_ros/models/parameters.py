"""The parameter table: every physical parameter with unit, meaning, range and source, gathered from the blocks.

It makes the ROS parameter descriptors, and it validates fibre files.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms import Parameter
from xb_muscle_ros.models.composition import distinct
from xb_muscle_ros.models.registry import BLOCKS, METHODS, MODELS, compose

CONSTANTS: Mapping[str, Parameter] = MappingProxyType(
    {
        row.name: row
        for row in (
            Parameter("reference_length_m", "m", "fibre length at rest: one L0", 1e-9, 10.0, 1.0, "the fibre's record"),
            Parameter("f0_n", "N", "isometric force at pCa 4.5: one F0", 1e-12, 1e6, 1.0, "the fibre's record"),
        )
    }
)


def _gather() -> Mapping[str, Parameter]:
    rows = [row for model in MODELS for row in compose(model).parameters]
    rows += [row for method in METHODS.values() for row in method.parameters]
    rows += [row for block in BLOCKS for row in block.parameters]
    return MappingProxyType({row.name: row for row in distinct(rows)})


PARAMETERS: Mapping[str, Parameter] = _gather()


def checked(name: str, value: object, table: Mapping[str, Parameter], where: str) -> float:
    """Return a parameter's value as a float if the table allows it.

    Args:
        name: the parameter.
        value: as read; a number.
        table: rows by name.
        where: file and set, for the message.

    Raises:
        UserError: unknown name, not a number, not finite, or out of range.
    """
    if name not in table:
        raise UserError(f"{where}: parameter '{name}' is not known{suggest(name, table)}")
    row = table[name]
    unit = "" if row.unit == "1" else f" {row.unit}"
    allowed = f"allowed is {row.lower:g} to {row.upper:g}{unit}"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise UserError(f"{where}: parameter '{name}' is {value!r}, not a number; {allowed} ({row.meaning})")
    number = float(value)
    if not math.isfinite(number) or not row.lower <= number <= row.upper:
        raise UserError(f"{where}: parameter '{name}' is {number:g}{unit}; {allowed} ({row.meaning})")
    return number


def complete(values: Mapping[str, float], model: str, where: str, method: str = "gaussian") -> dict[str, float]:
    """Values of all parameters a model and a method need, defaults filled in; those of other methods are left out.

    Raises:
        UserError: a parameter without a default is missing, or one is given that the model does not have.
    """
    needed = {row.name: row for row in compose(model, method).parameters}
    of_methods = {row.name for other in METHODS.values() for row in other.parameters}
    for name in values:
        if name not in needed and name not in of_methods:
            raise UserError(f"{where}: model {model} has no parameter '{name}'{suggest(name, needed)}")
    full: dict[str, float] = {}
    for name, row in needed.items():
        if name in values:
            full[name] = values[name]
        elif row.default is None:
            raise UserError(
                f"{where}: model {model} needs parameter '{name}' ({row.meaning}, {row.unit}); add it to the set, or "
                "to --set where a command has it"
            )
        else:
            full[name] = row.default
    return full
