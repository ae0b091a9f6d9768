"""Everything that a diagnosis may answer: the mechanisms of the registry, and measurement artefacts."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from xb_muscle_ros.diagnose import names
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.catalogue import CATALOGUE

for _name in MEASUREMENT:
    if _name in CATALOGUE:
        raise UserError(f"mechanism '{_name}' has the name of a measurement artefact; choose another one")
MECHANISMS: tuple[Name, ...] = (
    *(name for name in names.MECHANISMS if name in CATALOGUE),
    *(Name(name) for name in CATALOGUE if name not in names.MECHANISMS),
)
"""Every mechanism: those of the blind benchmark in their usual order, then the others."""
NAMES: tuple[Name, ...] = (*MECHANISMS, *MEASUREMENT)
"""All of them, in the order in which they are listed and fitted."""
FAMILY: Mapping[str, str] = MappingProxyType(
    {name: CATALOGUE[name].family if name in CATALOGUE else names.FAMILY[name] for name in NAMES}
)
"""Family of every name."""
