"""A number read off a force: with its standard error, or without a value and with the reason."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from xb_muscle_ros.tables import unsound

# A number within a reason, with its sign and exponent.
_NUMBER = re.compile(r"[-−]?\d+(\.\d+)?(e[-+]?\d+)?")


class Estimate(NamedTuple):
    """One number.

    Attributes:
        value: None where there is none.
        se: standard error, in the unit of the value; None where it is not known, and for simulated forces, which have
            no noise.
        why: why there is no value, or no standard error of a measured one, or what was left out for it; empty where
            there is nothing to say.
    """

    value: float | None
    se: float | None = None
    why: str = ""


class Missing(NamedTuple):
    """Why something cannot be had, in words."""

    why: str


def samples(count: int) -> str:
    """So many samples, in words."""
    return f"{count} sample{'' if count == 1 else 's'}"


def rounded(se: float) -> float:
    """A standard error to three digits: more are never known, and they would depend on the machine."""
    return float(f"{se:.3g}")


def quotient(value: Estimate, reference: Estimate) -> Estimate:
    """Quotient of two numbers whose errors are independent; its standard error to first order.

    No value where either is missing, the reference is zero, or its standard error is as large as itself: a quotient to
    it may be anything.
    """
    if value.value is None or reference.value is None:
        return Estimate(None, why=value.why or reference.why)
    if not reference.value:
        return Estimate(None, why="the reference is zero")
    if unsound(reference.value, reference.se):
        return Estimate(None, why=f"the reference is {reference.value:.3g} ± {reference.se:.2g} (SE)")
    ratio = value.value / reference.value
    if value.se is None or reference.se is None:
        return Estimate(ratio, why=value.why or reference.why)
    return Estimate(ratio, rounded(math.hypot(value.se, ratio * reference.se) / abs(reference.value)))


def without_numbers(text: str) -> str:
    """A text by which those that differ in numbers alone are the same."""
    return _NUMBER.sub("#", text)


def notes_of(told: Sequence[tuple[str, str]]) -> list[str]:
    """Lines on numbers that are missing, those that are missing for one reason in one line.

    Args:
        told: of each the trial, and ``what: why``. Reasons that differ in numbers alone are one.
    """
    kinds: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for trial, line in told:
        what, _, why = line.partition(": ")
        kinds.setdefault((what, without_numbers(why)), []).append((trial, why))
    lines = []
    for (what, _), found in kinds.items():
        more = f", and of {len(found) - 1} more trials" if len(found) > 2 else f", and of {found[-1][0]}"
        other = "" if all(why == found[0][1] for _, why in found) else " (in the first; in others with other numbers)"
        lines.append(f"{what}, of trial {found[0][0]}{more if len(found) > 1 else ''}: {found[0][1]}{other}")
    return lines
