"""The protocol in the header of a 600A file: control functions at their times, and the stretches they make."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.trials.trial import Array

_STEP = re.compile(r"\s*([\d.,]+)\s+([A-Za-z]\S*)\s*(.*?)\s*")
_OPTION = re.compile(r"([+-]?)\s*(\d+(?:[.,]\d*)?|[.,]\d+)\s*([^\W\d]+)?")
# Control functions that move the motor, or may; samples and triggers do not.
_MOVES = re.compile(r"(?:(?:Length|Force|SL)-(?!Sample|Trigger)|.*Larb).*", re.IGNORECASE)
_RAMP, _BATH = "length-ramp", "bath"
_MS = 1e-3
# So many control functions are told one by one.
_MOST = 12
_SAME = 1e-6


class Option(NamedTuple):
    """A number of an option: its sign as written (empty where it is absolute), its value and unit."""

    sign: str
    value: float
    unit: str


class Step(NamedTuple):
    """A control function: time in the clock of the data (s), its name, and its options as in the file."""

    time_s: float
    function: str
    options: str

    @classmethod
    def read(cls, line: str) -> Step | None:
        """The step of a line of the protocol; None where it is none."""
        match = _STEP.fullmatch(line)
        time = _value(match[1]) if match is not None else math.nan
        if match is None or not math.isfinite(time):
            return None
        return cls(time * _MS, match[2], " ".join(match[3].split()))

    def numbers(self) -> list[Option]:
        """Its options that are numbers."""
        found = _OPTION.findall(self.options)
        return [Option(sign, _value(f"{sign}{digits}"), unit or "") for sign, digits, unit in found]


class Stretches(NamedTuple):
    """The paper's protocol by its commands: amplitude (L0), recovery (s) and begin of the test stretch (s).

    Amplitude and recovery are None where the record itself has to tell them.
    """

    amplitude_l0: float | None
    recovery_s: float | None
    test_start_s: float


def _value(text: str) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return math.nan


def stretches(protocol: Iterable[Step], from_s: float, to_s: float) -> Stretches | None:
    """The stretches a protocol commands within a record; None where it is not plainly the paper's protocol.

    It is where nothing but ramps by signed amounts moves the motor: one stretch, or stretch, shortening back by the
    same amount, and stretch.

    Args:
        from_s, to_s: first and last sample, s.
    """
    ramps: list[tuple[float, float, float, str]] = []
    for step in protocol:
        if not from_s <= step.time_s <= to_s or not _MOVES.fullmatch(step.function):
            continue
        numbers = step.numbers()
        if step.function.casefold() != _RAMP or len(numbers) < 2 or not numbers[0].sign or numbers[1].unit != "ms":
            return None
        if numbers[0].value:
            ramps.append((step.time_s, numbers[1].value * _MS, numbers[0].value, numbers[0].unit))
    amounts = [ramp[2] for ramp in ramps]
    if len(ramps) == 1 and amounts[0] > 0.0:
        return Stretches(None, None, ramps[0][0])
    if len(ramps) != 3 or not amounts[0] > 0.0 > amounts[1] or not amounts[2] > 0.0:
        return None
    if abs(amounts[0] + amounts[1]) > _SAME * amounts[0]:
        return None
    (_, _, amount, unit), (down_s, taken_s, _, _), (test_s, _, _, _) = ramps
    recovery_s = test_s - down_s - taken_s
    if recovery_s < 0.0:
        return None
    return Stretches(amount if unit == "Lo" else None, round(recovery_s, 9), test_s)


def bath_warnings(path: Path, protocol: Sequence[Step], time_s: Array) -> tuple[str, ...]:
    """A line where the bath is changed within the record, though one pCa holds for it."""
    changes = [step for step in protocol if step.function.casefold() == _BATH and time_s[0] < step.time_s < time_s[-1]]
    if not changes:
        return ()
    shown = ", ".join(f"to {step.options or 'another'} at {step.time_s:.6g} s" for step in changes[:3])
    return (
        f"{path}: the protocol changes the bath within the record ({shown}); one pCa is taken for all of it; cut the "
        "record, or give a column of calcium",
    )


def in_words(protocol: Sequence[Step]) -> str:
    """The first control functions with their times."""
    shown = [f"{step.function} at {step.time_s:.6g} s" + _of(step.options) for step in protocol[:_MOST]]
    more = len(protocol) - _MOST
    return ", ".join(shown) + (f", and {more} more" if more > 0 else "")


def _of(options: str) -> str:
    return f" ({options})" if options else ""
