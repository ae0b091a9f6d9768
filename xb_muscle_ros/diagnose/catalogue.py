"""What a diagnosis may put into a model: the mechanisms of the common catalogue, by the names of its answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Coordinate, mechanism_coordinates
from xb_muscle_ros.models import catalogue
from xb_muscle_ros.models.registry import split_set, with_mechanisms


@dataclass(frozen=True)
class Entry(catalogue.Entry):
    """One mechanism as a candidate; see `models.catalogue.Entry`."""

    name: Name

    def coordinates(self, values: Mapping[str, float]) -> tuple[Coordinate, ...]:
        """Coordinates of the mechanism's parameters, started at some values."""
        return mechanism_coordinates(self, values)


def _candidate(row: catalogue.Entry) -> Entry:
    held = {each.name: getattr(row, each.name) for each in fields(row)}
    return Entry(**{**held, "name": Name(row.name)})


CATALOGUE: Mapping[Name, Entry] = MappingProxyType(
    {Name(row.name): _candidate(row) for row in catalogue.CATALOGUE.values()}
)
"""Every mechanism as a candidate."""


def applicable(model: str) -> tuple[Entry, ...]:
    """Mechanisms that can be put into a model; the others are part of it, or have nothing to act on."""
    found = []
    for entry in CATALOGUE.values():
        try:
            split_set(with_mechanisms(model, entry.name.value))
        except UserError:
            continue
        found.append(entry)
    return tuple(found)
