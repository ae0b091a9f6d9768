"""Where fits start that no line leads to: blocks that take the place of others, and the base."""

from __future__ import annotations

from collections.abc import Sequence

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.models.catalogue import CATALOGUE


def starts_of(systems: Sequence[System], name: Name) -> list[list[dict[str, float]]]:
    """Starts of a mechanism from the fibre file's own parameters."""
    return [[dict(s) for s in CATALOGUE[name.value].starting_values(system.fibre.values)] for system in systems]


def spread(system: System) -> list[dict[str, float]]:
    """Further points to start the base from: more and less cooperativity, faster and slower heads."""
    values = system.fibre.values
    found: list[dict[str, float]] = []
    for factors in ({"koop": 3.0, "kon": 0.6}, {"koop": 0.4, "kon": 1.4}, {"f": 0.7, "k11": 0.5}):
        start = {name: values[name] * factor for name, factor in factors.items() if values.get(name, 0.0) > 0.0}
        if start and start not in found:
            found.append(start)
    return found
