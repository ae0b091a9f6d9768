"""Standard deviations of ordinary measurement errors that a study has of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY

# An SD this share of the usual one is as good as none.
_LEAST = 1e-3


def error_sds_of(given: Sequence[str]) -> dict[str, float]:
    """Of arguments ``FAULT=SD``, by name of the fault.

    Raises:
        UserError: no fault that is ordinary, given twice, or no SD above 0.
    """
    found: dict[str, float] = {}
    for text in given:
        name, _, value = text.partition("=")
        if name in found:
            raise UserError(f"--nuisance {name} is given an SD twice; give it once")
        try:
            found[name] = float(value)
        except ValueError:
            raise UserError(
                f"--nuisance {text}: SD '{value}' is no number; give FAULT=SD without a unit, such as time_shift=0.002 "
                "(s)"
            ) from None
    told_of(found)
    return found


def told_of(error_sds: Mapping[str, float]) -> list[str]:
    """A line for each.

    Raises:
        UserError: no fault that is ordinary, or an SD that is not above 0 or is beyond the fault's bounds.
    """
    lines = []
    for name, sd in error_sds.items():
        if name in ARTEFACTS and name not in ORDINARY:
            raise UserError(
                f"--nuisance: '{name}' is a candidate of every diagnosis and no ordinary error; SDs are of "
                f"{', '.join(ORDINARY)}"
            )
        if name not in ORDINARY:
            raise UserError(f"--nuisance: ordinary measurement error '{name}' is not known{suggest(name, ORDINARY)}")
        row = ARTEFACTS[name]
        unit = "" if row.unit == "1" else f" {row.unit}"
        least = _LEAST * row.sd
        if not least <= sd <= row.upper:
            raise UserError(
                f"--nuisance: ordinary measurement error '{name}': SD {sd:g}{unit}; allowed is {least:g} to "
                f"{row.upper:g}{unit}; usual is {row.sd:g}{unit}"
            )
        lines.append(
            f"ordinary measurement error '{name}' has SD {sd:g}{unit}, as was asked (usually {row.sd:g}{unit})"
        )
    return lines
