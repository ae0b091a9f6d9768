"""One model with everything in it, in which a mechanism is absent where its effect is exactly nothing.

Blocks that take the place of others (the cooperative thin filament, the series spring, another half-sarcomere in
series) have no value at which they are absent: each combination of them is a frame, a model with everything else.
The thick filament that wakes by force is the one that is always on where nothing sends heads to rest (J2 = 0), and
tearing is absent at k = 0, so that these need no frames.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from dataclasses import replace
from types import MappingProxyType

from xb_muscle_ros.diagnose.answers import MECHANISMS
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import compose, model_of_set, place_of, row_of, with_mechanisms

FRAMES = tuple(Name(name) for name, entry in CATALOGUE.items() if entry.frame)
"""Mechanisms that are another model rather than a value."""


def beside(fibre: Fibre) -> tuple[Name, ...]:
    """Mechanisms that go beside a fibre's model, those of `FRAMES` among them."""
    return tuple(name for name in MECHANISMS if _goes(fibre.model, (name,)))


@functools.cache
def _goes(model: str, names: tuple[Name, ...]) -> bool:
    try:
        row_of(model_of_set(with_mechanisms(model, *names)))
    except UserError:
        return False
    return True


def together(names: Iterable[Name]) -> bool:
    """Whether no two of some names take the same place in a model."""
    places = [place for name in set(names) if name in CATALOGUE and (place := place_of(name))]
    return len(places) == len(set(places))


def frame_of(names: Iterable[Name]) -> tuple[Name, ...]:
    """The frame that a set of names needs."""
    return tuple(name for name in FRAMES if name in set(names))


def whole(fibre: Fibre, frame: Sequence[Name]) -> Fibre:
    """The fibre's model with everything in it, all of it absent but the frame.

    Args:
        fibre: as given; its own mechanisms stay.

    Raises:
        UserError: a frame that does not go with the model.
    """
    named = [*frame]
    for name in MECHANISMS:
        if name not in FRAMES and _goes(fibre.model, (*named, name)):
            named.append(name)
    model = with_mechanisms(fibre.model, *named)
    needed = {row.name for row in compose(model, fibre.method).parameters}
    values = {key: value for key, value in fibre.values.items() if key in needed}
    for name in named:
        for key, value in CATALOGUE[name].starting_values(fibre.values)[0].items():
            if key in needed:
                values.setdefault(key, value)
        if name not in frame:
            values |= CATALOGUE[name].absent
    full = complete(values, model_of_set(model), f"fibre {fibre.name}, model {model}", fibre.method)
    return replace(fibre, model=model, values=MappingProxyType(full))


def only(fibre: Fibre, given: Fibre, names: Sequence[Name]) -> Fibre:
    """The whole model's fibre without what is absent: a fibre that a user can run.

    Args:
        fibre: whole, with fitted values.
    """
    model = with_mechanisms(given.model, *names)
    needed = [row.name for row in compose(model, given.method).parameters]
    values = {key: fibre.values[key] for key in needed if key in fibre.values}
    full = complete(values, model_of_set(model), f"fibre {given.name}, model {model}", given.method)
    return replace(fibre, model=model, method=given.method, values=MappingProxyType(full))
