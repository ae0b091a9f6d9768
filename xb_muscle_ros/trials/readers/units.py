"""Units a recording may come in, and what they are in the units of a trial."""

from __future__ import annotations

import math
import re
import unicodedata
from typing import NamedTuple

from xb_muscle_ros.errors import UserError, suggest


class Unit(NamedTuple):
    """A unit: what it measures and how many of the kind's base unit it is (s, Hz, m, L0, N, Pa, F0, µM, V).

    Of a signal in volts it is what one of them stands for; `per` is then their unit, ``V`` or ``mV``.
    """

    kind: str
    factor: float
    per: str = ""


class Quantity(NamedTuple):
    """A number with its unit, converted: ``value`` is in the base unit of ``kind``."""

    value: float
    kind: str


_FACTORS = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "rate": {"Hz": 1.0, "kHz": 1e3},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9},
    "relative length": {"L0": 1.0, "%L0": 1e-2},
    # A force in grams is the weight of that mass, by the standard acceleration 9.80665 m/s².
    "force": {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "kg": 9.80665, "g": 9.80665e-3, "mg": 9.80665e-6},
    "stress": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "mN/mm2": 1e3, "N/cm2": 1e4, "mN/cm2": 10.0},
    "relative force": {"F0": 1.0, "%F0": 1e-2},
    "calcium": {"M": 1e6, "mM": 1e3, "uM": 1.0, "nM": 1e-3},
    # A logarithm, hence no factor: whoever converts it has to know.
    "pCa": {"pCa": math.nan},
    "stimulation": {"V": 1.0, "mV": 1e-3, "1": 1.0},
}
UNITS = {name: Unit(kind, factor) for kind, units in _FACTORS.items() for name, factor in units.items()}
KINDS = {
    "time": ("time",),
    "rate": ("rate",),
    "length": ("length", "relative length"),
    "force": ("force", "stress", "relative force"),
    "calcium": ("calcium", "pCa"),
    "stimulation": ("stimulation",),
}

# Other spellings, as headers have them.
_SPELLINGS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "Sec", "Seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("micron", "microns", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("kN/m2", "kpa", "KPa"), "kPa"),
    **dict.fromkeys(("N/mm2",), "MPa"),
    **dict.fromkeys(("N/m2",), "Pa"),
    **dict.fromkeys(("F/F0", "F/Fo", "Fo", "P/P0", "P/Po", "P0", "Po", "T/T0", "T/To"), "F0"),
    **dict.fromkeys(("%Fo", "%P0", "%Po"), "%F0"),
    **dict.fromkeys(("L/L0", "L/Lo", "Lo"), "L0"),
    **dict.fromkeys(("%Lo",), "%L0"),
    **dict.fromkeys(("gf", "gram", "grams"), "g"),
    **dict.fromkeys(("pca", "-log[Ca]"), "pCa"),
    **dict.fromkeys(("volt", "volts", "Volt", "Volts"), "V"),
    **dict.fromkeys(("millivolt", "millivolts", "mVolt", "mVolts"), "mV"),
}
# What a volt of a length or force stands for: ``0.5 mN/V``, negative where polarity is turned.
_CALIBRATED = ("length", "force")
_PER_VOLT = re.compile(
    r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(?P<unit>\S+?)\s*/\s*(?P<per>m?V)\s*"
)
# A number and its unit, with a blank between them or without.
_NUMBER_AND_UNIT = re.compile(
    r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"(?:\s+(?P<apart>\S+|(?:[^\W\d_]|%).*?)|(?![eE][+-]?\d)(?P<joined>[^\W\d_]\S*|%\S*))\s*"
)
VOLTS = ("V", "mV")
# A stress by its area: ``mN/mm^2``, ``N cm-2``, ``kN.m^-2``.
_PER_AREA = re.compile(r"(?P<unit>[A-Za-z]+)(?:\s*/\s*(?P<area>mm|cm|m)\^?2|[ .*·⋅](?P<area_below>mm|cm|m)\^?-2)")
_BRACKETED = re.compile(r"[(\[{<]\s*([^()\[\]{}<>]+?)\s*[)\]}>]\s*$")
_BEHIND = re.compile(r"[\w)][_ ,/;]+\s*([^\W\d_][^\s_,;]*|%\w+)$")


def finite(value: object, key: str, where: str) -> float:
    """A number.

    Raises:
        UserError: it is none, or not finite.
    """
    try:
        number = float(value)  # type: ignore[arg-type]  # whatever it cannot take is told below
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise UserError(f"{where}: {key} is {value!r}; needed is a finite number")
    return number


def unit_of(text: str, column: str, where: str) -> Unit:
    """The unit named ``text`` for a column of ``time``, ``length``, ``force``, ``calcium`` or ``stimulation``.

    A length or force in volts has a calibration in its place, such as ``0.5 mN/V``.

    Raises:
        UserError: unknown unit, one of something else, or a calibration of zero.
    """
    name = simple(text)
    name = _SPELLINGS.get(name, name)
    allowed = [known for known, unit in UNITS.items() if unit.kind in KINDS[column]]
    if column in _CALIBRATED and name.rpartition("/")[2] in VOLTS and name.rpartition("/")[0] in allowed:
        raise UserError(f"{where}: unit '{text}' of {column} lacks the number before it, for example '0.5 {text}'")
    volts = _PER_VOLT.fullmatch(name) if column in _CALIBRATED else None
    if volts is not None and volts["unit"] in allowed:
        number = float(volts["number"])
        if number == 0.0 or not math.isfinite(number):
            raise UserError(f"{where}: unit '{text}' of {column} makes nothing of a volt; give what one stands for")
        own = UNITS[volts["unit"]]
        return Unit(own.kind, number * own.factor, volts["per"])
    if name in VOLTS and column in _CALIBRATED:
        raise UserError(f"{where}: '{text}' is no unit of {column}; in its place give {calibration(column, name)}")
    if name not in UNITS:
        raise UserError(f"{where}: unit '{text}' of {column} is not known{suggest(name, allowed)}")
    if name not in allowed:
        raise UserError(f"{where}: '{text}' is no unit of {column}; allowed: {', '.join(allowed)}")
    return UNITS[name]


def unit_in(text: str, column: str) -> str | None:
    """The name of the unit that text in a file stands for, where it is one of the column's; None where not."""
    name = simple(text.strip().strip("()[]{}<>").strip())
    name = _SPELLINGS.get(name, name)
    return name if name != "1" and name in UNITS and UNITS[name].kind in KINDS[column] else None


def header_unit(name: str) -> str:
    """What a column's name has of a unit: ``Force (mN)``, ``Length [mm]``, ``Force_mN``, ``Time, s``; empty if none."""
    match = _BRACKETED.search(name) or _BEHIND.search(name)
    found = match.group(1) if match else name if name == "pCa" else ""
    return found if any(unit_in(found, signal) for signal in KINDS) else ""


def calibration(column: str, volts: str) -> str:
    """What has to be given of a length or force in volts, in words."""
    return f"what one {volts} stands for, for example '{'0.5 mN' if column == 'force' else '0.1 mm'}/{volts}'"


def volts_of(unit: str, column: str) -> str:
    """``V`` or ``mV``, where that is what a file tells of a length or force; else empty."""
    found = unit_in(unit, "stimulation") if column in _CALIBRATED else None
    return found if found in VOLTS else ""


def reading(text: str, column: str, unit: Unit, what: str, where: str, example: str) -> Quantity:
    """What a column reads, such as ``0.12 V`` or ``42.5 mm``, in the base unit of what it measures.

    Args:
        unit: of the column; where that is a calibration, the reading may be in volts.

    Raises:
        UserError: no number with a unit that fits.
    """
    value, name = number_and_unit(text)
    if not math.isfinite(value):
        raise UserError(f"{where}: {what} is '{text}'; needed is a number and its unit, for example '{example}'")
    if unit.per and name in VOLTS:
        return Quantity(value * UNITS[name].factor / UNITS[unit.per].factor * unit.factor, unit.kind)
    own = _plain_unit(name, column, what, where)
    return Quantity(value * own.factor, own.kind)


def number_and_unit(text: str) -> tuple[float, str]:
    """The two parts of a reading such as ``42.5 mm`` or ``42.5mm``; the number is NaN where it is none."""
    match = _NUMBER_AND_UNIT.fullmatch(text)
    return (math.nan, "") if match is None else (float(match["number"]), match["apart"] or match["joined"])


def _plain_unit(text: str, column: str, what: str, where: str) -> Unit:
    """A unit that is no calibration."""
    allowed = ", ".join(known for known, unit in UNITS.items() if unit.kind in KINDS[column])
    if text in VOLTS or _PER_VOLT.fullmatch(simple(text)):
        raise UserError(f"{where}: {what} is in '{text}'; needed is a {column} in one of {allowed}")
    return unit_of(text, column, f"{where}: {what}")


def simple(text: str) -> str:
    """A unit in one way of writing: ``mN·mm⁻²``, ``mN mm^-2`` and ``mN/mm²`` are ``mN/mm2``."""
    plain = unicodedata.normalize("NFKC", text).strip().replace("μ", "u").replace("\u2212", "-")
    per = _PER_AREA.fullmatch(plain)
    if per is not None:
        return f"{per['unit']}/{per['area'] or per['area_below']}2"
    return re.sub(r"^%\s+", "%", plain)


def quantity(text: str, column: str, what: str, where: str, example: str = "42.8 mm", zero: bool = False) -> Quantity:
    """A quantity such as ``42.8 mm``, above zero (or zero too), in a unit that fits the column.

    Raises:
        UserError: no such number with a fitting unit; the message shows the example.
    """
    value, name = number_and_unit(text)
    if not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
        least = "from" if zero else "above"
        raise UserError(
            f"{where}: {what} is '{text}'; needed is a number {least} 0 and its unit, for example '{example}'"
        )
    unit = _plain_unit(name, column, what, where)
    return Quantity(value * unit.factor, unit.kind)
