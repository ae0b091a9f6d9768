"""Passive force of a model: the set's own parallel element, and the mechanism of force and length."""

from __future__ import annotations

from collections.abc import Mapping

OWN = ("kpe", "Fpe0")
"""Parameters with which, at 0, a set's own parallel element bears nothing."""
_RELATION = "fp_max"


def without_own(values: Mapping[str, float]) -> dict[str, float]:
    """Changes that leave a set's own parallel element out."""
    return {name: 0.0 for name in OWN if name in values}


def passive_twice_line(values: Mapping[str, float]) -> str:
    """One line where both bear force, which is one tissue's; empty where at most one does."""
    own = [f"{name} {values[name]:.3g}" for name in OWN if values.get(name, 0.0) != 0.0]
    if not own or values.get(_RELATION, 0.0) <= 0.0:
        return ""
    return (
        f"passive force is there twice and adds up: passive_force_length (fp_max {values[_RELATION]:.3g}) and the "
        f"set's own parallel element ({', '.join(own)}); set {' and '.join(OWN)} to 0, or fp_max"
    )
