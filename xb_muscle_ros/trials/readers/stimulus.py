"""The ``activation`` of a mapping: levels and time constants of calcium, and when there is stimulation."""

from __future__ import annotations

import math

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.readers.description import Activation
from xb_muscle_ros.trials.readers.tree import Keys
from xb_muscle_ros.trials.readers.units import quantity

NEVER = "never"
FORCE_DROP = "force_drop"
_CONSTANTS = {"rest": "0.05 uM", "tetanus": "8 uM", "rise": "50 ms", "decay": "30 ms"}


def read_activation(mapping: Keys) -> Activation | None:
    """The activation of a mapping, where it has one.

    Raises:
        UserError: an unknown or missing key, or a value that is not allowed.
    """
    if mapping.values.get("activation") is None:
        return None
    keys = mapping.below("activation", *_CONSTANTS, "source", "begin", "end")
    values = [_constant(keys, name, example) for name, example in _CONSTANTS.items()]
    with naming(keys.where):
        transient = CalciumTransient(*values)
    return Activation(transient, keys.line("source"), *_times(keys))


def _constant(keys: Keys, name: str, example: str) -> float:
    text = keys.text(name, f"give a value with its unit, for example '{example}'")
    found = quantity(text, "time" if example.endswith("ms") else "calcium", keys.name(name), keys.where, example)
    # pCa is a logarithm: quantity leaves it alone.
    return 10.0 ** (6.0 - float(text.split()[0])) if found.kind == "pCa" else found.value


def _times(keys: Keys) -> tuple[float | None, float | None]:
    begin, end = keys.values.get("begin"), keys.values.get("end")
    if begin is None:
        if end is not None:
            raise UserError(f"{keys.where}: activation.end needs activation.begin, for example 'begin: 1 s'")
        return None, None
    if begin == NEVER:
        return math.inf, math.inf
    begin_s = keys.amount("begin", "time", "1 s", zero=True)
    if end is None:
        raise UserError(f"{keys.where}: activation.end is missing; give a time such as '2 s', or {FORCE_DROP}")
    if end == FORCE_DROP:
        return begin_s, None
    end_s = keys.amount("end", "time", "2 s")
    if begin_s is not None and end_s is not None and end_s <= begin_s:
        raise UserError(
            f"{keys.where}: activation goes from {begin_s:g} to {end_s:g} s; its end has to come after its begin"
        )
    return begin_s, end_s
