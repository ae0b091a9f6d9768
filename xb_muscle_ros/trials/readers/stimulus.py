"""The ``activation`` of a mapping: levels and time constants of calcium, and when there is stimulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.readers.description import Activation
from xb_muscle_ros.trials.readers.tree import check_keys, text_at, words_at
from xb_muscle_ros.trials.readers.units import quantity

NEVER = "never"
FORCE_DROP = "force_drop"
_CONSTANTS = {"rest": "0.05 uM", "tetanus": "8 uM", "rise": "50 ms", "decay": "30 ms"}


def read_activation(tree: Mapping[str, Any], where: str) -> Activation:
    """Check the activation of a mapping.

    Raises:
        UserError: an unknown or missing key, or a value that is not allowed.
    """
    check_keys(tree, (*_CONSTANTS, "source", "begin", "end"), "activation.", where)
    values = {name: _constant(tree, name, where) for name in _CONSTANTS}
    try:
        transient = CalciumTransient(*values.values())
    except UserError as problem:
        raise UserError(f"{where}: {problem}") from None
    begin_s, end_s = _times(tree, where)
    return Activation(transient, words_at(tree, "source"), begin_s, end_s)


def _constant(tree: Mapping[str, Any], name: str, where: str) -> float:
    example = _CONSTANTS[name]
    text = text_at(tree, name, f"{where}: activation", needed=f"give a value with its unit, for example '{example}'")
    found = quantity(text, "time" if example.endswith("ms") else "calcium", f"activation.{name}", where, example)
    # pCa is a logarithm: quantity leaves it alone.
    return 10.0 ** (6.0 - float(text.split()[0])) if found.kind == "pCa" else found.value


def _times(tree: Mapping[str, Any], where: str) -> tuple[float | None, float | None]:
    begin, end = tree.get("begin"), tree.get("end")
    if begin is None:
        if end is not None:
            raise UserError(f"{where}: activation.end needs activation.begin, for example 'begin: 1 s'")
        return None, None
    if str(begin) == NEVER:
        return math.inf, math.inf
    begin_s = quantity(str(begin), "time", "activation.begin", where, "1 s", zero=True).value
    if end is None:
        raise UserError(f"{where}: activation.end is missing; give a time such as '2 s', or {FORCE_DROP}")
    if str(end) == FORCE_DROP:
        return begin_s, None
    end_s = quantity(str(end), "time", "activation.end", where, "2 s").value
    if end_s <= begin_s:
        raise UserError(
            f"{where}: activation goes from {begin_s:g} to {end_s:g} s; its end has to come after its begin"
        )
    return begin_s, end_s
