"""The node's own parameters, one row each, and the descriptors that ROS tools show."""

# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms.base import Parameter as Physical
from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS, checked
from xb_muscle_ros.node.foreign_keys import GROUPS, of_a_fibre
from xb_muscle_ros.node.watchdog import DECAY, HOLD, ISOMETRIC

Value = bool | int | float | str | tuple[str, ...]

# When a parameter may be set: at the start of the process only, unconfigured, anything but active, at any time.
START, UNCONFIGURED, INACTIVE, ALWAYS = "at the start only", "when unconfigured", "when not active", "at any time"


class Row(NamedTuple):
    """One parameter of the node."""

    default: Value
    meaning: str
    when: str
    unit: str = ""
    bounds: tuple[float, float] = (-math.inf, math.inf)
    choices: tuple[str, ...] = ()


NODE_PARAMETERS: Mapping[str, Row] = {
    "autostart": Row(True, "configure and activate without being asked", START),
    "mode": Row(
        "realtime",
        "realtime: steps at rate_hz by the steady clock; lockstep: one step per length (or load) message, by its stamp",
        START,
        choices=("realtime", "lockstep"),
    ),
    "control": Row(
        "length",
        "length: length in, force out; force: load in, length out (force clamp)",
        START,
        choices=("length", "force"),
    ),
    "fiber_file": Row("", "fibre file, path or packaged fibre name; empty: parameters hold it", UNCONFIGURED),
    "fiber_files": Row(("",), "one fibre file for each of many fibres, in order; empty: not many", UNCONFIGURED),
    "fibers": Row(("",), "names of many fibres, as in the messages; empty: those of fiber_files", UNCONFIGURED),
    "threads": Row(1, "threads that step many fibres, at most one for each core", INACTIVE, bounds=(1, 256)),
    "rate_hz": Row(1000.0, "steps per second in realtime mode", INACTIVE, unit="Hz", bounds=(10.0, 10000.0)),
    "extrapolate": Row(False, "between length samples go on with their velocity instead of holding the length", ALWAYS),
    "extrapolation_limit_s": Row(
        0.02,
        "longest time a length sample is carried on by its velocity; held afterwards",
        ALWAYS,
        unit="s",
        bounds=(0.0, 1.0),
    ),
    "max_catch_up": Row(
        10,
        "most ticks made up for at once after a late wake-up; more are dropped",
        ALWAYS,
        unit="ticks",
        bounds=(0, 1000),
    ),
    "timeout_s": Row(
        0.0,
        "age of the newest length (or load) sample beyond which on_timeout acts; 0: no age is too old",
        ALWAYS,
        unit="s",
        bounds=(0.0, 3600.0),
    ),
    "on_timeout": Row(
        ISOMETRIC,
        "hold: the last sample goes on; isometric: the fibre keeps its length; decay: isometric, calcium falls to zero",
        ALWAYS,
        choices=(HOLD, ISOMETRIC, DECAY),
    ),
    "decay_s": Row(0.1, "time constant of calcium with on_timeout decay", ALWAYS, unit="s", bounds=(0.001, 1000.0)),
    "realtime_priority": Row(
        0, "priority of the ticks' thread under SCHED_FIFO, where permitted; 0: ordinary", INACTIVE, bounds=(0, 99)
    ),
    "lock_memory": Row(False, "keep the process in memory while active, where permitted", INACTIVE),
    "state_file": Row("", "file that ~/save_state writes and ~/load_state reads", ALWAYS),
    "load_state_at_start": Row(
        False, "when configuring go on with the state in state_file, as ~/load_state does", UNCONFIGURED
    ),
}

# A state is of its grid: with another it would mean something else, or not fit.
OF_GRIDS = ("bins", "strain_range")

TEXTS: Mapping[str, str] = {
    "fibre": "name of the fibre, as in the messages",
    "model": "parameter set in use, one of those under models",
    "method": "representation of the cross-bridge distribution",
    "source": "where the values come from",
}


def is_text(name: str) -> bool:
    """Whether a parameter of the fibre is text and no number."""
    return name in TEXTS or name.startswith("sources.") or name.endswith(".source")


# Parameters that rclpy itself declares.
_FOREIGN = ("use_sim_time", "start_type_description_service", "qos_overrides.")


def is_fibre_parameter(name: str) -> bool:
    """Whether a parameter belongs to the fibre and not to the node or to rclpy."""
    return name not in NODE_PARAMETERS and not is_foreign(name)


def is_foreign(name: str) -> bool:
    """Whether rclpy itself looks after a parameter."""
    return name.startswith(_FOREIGN)


def of_muscle_node(name: str) -> bool:
    """Whether a name is one of the muscle node's, or of one of its fibres."""
    return name in NODE_PARAMETERS or name in TEXTS or any(part in GROUPS for part in name.split(".")[:2])


def check_value(name: str, row: Row, value: object) -> Value:
    """Return a value of the row's type; whole numbers may stand for floating ones.

    Raises:
        UserError: another type, not finite, out of range, or not among the choices.
    """
    kind = type(row.default)
    if kind is tuple:
        return _texts(name, value)
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind:
        raise UserError(f"parameter '{name}' is {value!r}; it takes a {_KINDS[kind]}, for example {row.default!r}")
    if isinstance(value, str):
        if row.choices and value not in row.choices:
            raise UserError(f"parameter '{name}' is '{value}'; allowed is {' or '.join(row.choices)}")
        return value
    # A bool is a number too, and within infinite bounds.
    assert isinstance(value, (bool, int, float))
    lower, upper = row.bounds
    if not lower <= value <= upper:
        unit = f" {row.unit}" if row.unit else ""
        raise UserError(
            f"parameter '{name}' is {value:g}{unit}; allowed is {lower:g} to {upper:g}{unit} ({row.meaning})"
        )
    return value


def check_fibre_parameter(name: str, value: object) -> float:
    """Return a number for a parameter of the fibre, such as ``models.3state_coop.f``, or of one of many.

    Raises:
        UserError: the name is not known, or the value not allowed.
    """
    key, table = _entry(name)
    return checked(key, value, table, "parameters")


def _entry(name: str) -> tuple[str, Mapping[str, Physical]]:
    """A parameter of a fibre, or of one of many, by its name in one of the tables of all parameters, and the table."""
    head, _, rest = name.partition(".")
    if head not in GROUPS and rest:
        head, _, rest = rest.partition(".")
    return (rest, CONSTANTS) if head == "constants" else (rest.rpartition(".")[2], PARAMETERS)


def _texts(name: str, value: object) -> tuple[str, ...]:
    """A list of texts; an empty list has no type in ROS and reads as one empty text."""
    if isinstance(value, Sequence) and not isinstance(value, str) and all(isinstance(text, str) for text in value):
        return tuple(value) or ("",)
    raise UserError(f"parameter '{name}' is {value!r}; it takes a list of texts, for example ['left', 'right']")


_KINDS = {bool: "bool", int: "whole number", float: "number", str: "text"}


def meant_as_number(parameter: Any) -> Any:
    """A parameter for a number, given as ROS' tools give some of them.

    On a command line 80 is meant as 80.0; a dump has 1e-05, without a point, and loading takes that for text.
    """
    if parameter.type_ == Parameter.Type.INTEGER:
        return Parameter(parameter.name, value=float(parameter.value))
    if parameter.type_ == Parameter.Type.STRING:
        try:
            return Parameter(parameter.name, value=float(parameter.value))
        except ValueError:
            return parameter
    return parameter


class NotDeclared(ParameterNotDeclaredException):
    """The one exception that the parameter services turn into a refusal with its text as the reason."""

    def __init__(self, error: UserError) -> None:
        Exception.__init__(self, str(error))


def unknown(name: str, declared: Iterable[str]) -> UserError:
    """What to say of a parameter that is not there."""
    declared = [*declared]
    if of_a_fibre(name) and not any(of_a_fibre(n) or of_a_fibre(n.partition(".")[2]) for n in declared):
        return UserError(
            f"parameter '{name}' is there while the node is configured; configure it first, or give it in a parameter "
            "file at the start"
        )
    known = {n for n in declared if not is_foreign(n)} | set(NODE_PARAMETERS) | set(TEXTS)
    return UserError(f"parameter '{name}' is not known{suggest(name, known)}")


def row_descriptor(row: Row) -> ParameterDescriptor:
    """Descriptor of a parameter that a row describes."""
    unit = f" [{row.unit}]" if row.unit else ""
    descriptor = ParameterDescriptor(description=f"{row.meaning}{unit}; set {row.when}", read_only=row.when == START)
    if row.choices:
        descriptor.additional_constraints = f"one of: {', '.join(row.choices)}"
    lower, upper = row.bounds
    if isinstance(row.default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=lower, to_value=upper)]
    elif isinstance(row.default, int) and not isinstance(row.default, bool):
        descriptor.integer_range = [IntegerRange(from_value=int(lower), to_value=int(upper), step=1)]
    return descriptor


def fibre_descriptor(name: str) -> ParameterDescriptor:
    """Descriptor of a parameter of a fibre, such as ``models.3state_coop.f``, from the table of all parameters.

    Raises:
        UserError: the name is not known.
    """
    if is_text(name):
        meaning = TEXTS.get(name, "where the values of the set come from")
        return ParameterDescriptor(description=f"{meaning}; set {UNCONFIGURED}")
    key, table = _entry(name)
    if key not in table:
        raise UserError(f"parameter '{name}' is not known{suggest(key, table)}")
    when = f"set {UNCONFIGURED if key in OF_GRIDS else ALWAYS}"
    if table is CONSTANTS:
        when = "takes effect at the next reset"
    row = table[key]
    return ParameterDescriptor(
        description=f"{row.meaning} [{row.unit}]; {when}; source: {row.source}",
        floating_point_range=[FloatingPointRange(from_value=row.lower, to_value=row.upper)],
    )
