"""A fibre file to start from, of what is known of a fibre."""

from __future__ import annotations

import math
import re
from pathlib import Path

from xb_muscle_ros.api.telling import Lines, Tell
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_making import KnownOfFibre, known_like, make_fibre
from xb_muscle_ros.trials.readers.length import L0_RANGE_M
from xb_muscle_ros.trials.readers.mapping import F0_RANGES
from xb_muscle_ros.trials.readers.units import number_and_unit, quantity

_AREAS_M2 = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6, "um2": 1e-12}


def new_fibre(
    name: str,
    folder: str | Path = ".",
    *,
    like: str | None = None,
    model: str | None = None,
    length: str | float | None = None,
    f0: str | float | None = None,
    area: str | float | None = None,
    temperature: float | None = None,
    q10: float | None = None,
    species: str | None = None,
    muscle: str | None = None,
    overwrite: bool = False,
    tell: Tell | None = None,
) -> Path:
    """Write a fibre file from a published parameter set and what is known of the fibre; what is not known is said.

    Args:
        name: of the fibre; the file is ``<name>.yaml``.
        folder: for the file; made if need be.
        like: fibre of the package to start from; None: the one whose parameters are nearest to the median of all.
        model: parameter set that the file picks; None: that of the published file.
        length: L0, text such as ``'1.2 mm'`` or a number in m.
        f0: F0, text such as ``'0.5 mN'`` or a number in N.
        area: cross-section, text such as ``'0.005 mm2'`` or a number in m²; set beside F0, it tells the stress.
        temperature: of the experiments, °C. Rates are scaled to it only with `q10`.
        q10: factor of all rates per 10 K.
        species: in words; the package's fibres are of rat soleus.
        muscle: in words.
        overwrite: replace a file of this name.
        tell: hears each line on where values come from; None: a `DataWarning` each.

    Returns:
        the file; it loads, and the fibre settles at pCa 9 and 4.5 and steps.

    Raises:
        UserError: a value out of range, an unknown fibre or model, or a file that is there; nothing is written then.

    Source:
        parameter sets of van der Zee et al. 2026; the rule for temperature is that of mechanism ``temperature``.

    Examples:
        >>> import tempfile, xb_muscle_ros as xb
        >>> lines = []
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = xb.new_fibre("mine", folder, like="18Dec2017a", f0="0.5 mN", length="1.2 mm", tell=lines.append)
        ...     xb.load_fibre(file).f0_n
        0.0005
    """
    known = KnownOfFibre(
        reference_length_m=_amount("--length", length, "length", "1.2 mm", L0_RANGE_M),
        f0_n=_amount("--f0", f0, "force", "0.5 mN", F0_RANGES["force"][:2]),
        area_m2=_area(area),
        temperature_c=temperature,
        species=species,
        muscle=muscle,
        q10=q10,
    )
    file = Path(folder) / f"{name}.yaml"
    told = make_fibre(file, name, known, None if like is None else known_like(like), model, overwrite)
    Lines(tell).say(*told)
    return file


def _amount(
    option: str, given: str | float | None, kind: str, example: str, allowed: tuple[float, float]
) -> float | None:
    if given is None:
        return None
    if isinstance(given, str):
        found = quantity(given, kind, "value", option, example)
        if found.kind != kind:
            raise UserError(f"{option} is '{given}'; needed is a {kind}, for example '{example}'")
        # 1.05 mm is 0.00105 m, and not the next number.
        value = float(f"{found.value:.15g}")
    else:
        value = float(given)
    low, high = allowed
    if not low <= value <= high:
        unit = {"length": "m", "force": "N"}[kind]
        raise UserError(f"{option} is {value:g} {unit}; allowed is {low:g} to {high:g} {unit}; is its unit right?")
    return value


def _area(given: str | float | None) -> float | None:
    if given is None:
        return None
    if isinstance(given, str):
        number, name = number_and_unit(given)
        unit = re.sub("[µμ]", "u", name).replace("²", "2").replace("^", "")
        value = float(f"{number * _AREAS_M2.get(unit, math.nan):.15g}")
    else:
        value = float(given)
    if not 0.0 < value < 1.0:
        raise UserError(f"--area is '{given}'; needed is a number above 0 with {', '.join(_AREAS_M2)}, as '0.005 mm2'")
    return value
