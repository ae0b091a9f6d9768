"""Named models: each a row of blocks. A new mechanism adds its file, and one row here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple

from xb_muscle_ros.distribution.base import Representation
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.distribution.grid import Characteristics, ConservativeFixedGrid, FixedGrid
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms.activation.sigmoid import SigmoidActivation
from xb_muscle_ros.mechanisms.attachment.gaussian import GaussianAttachment
from xb_muscle_ros.mechanisms.base import Attachment, Detachment, Parallel, Series, ThickFilament, ThinFilament
from xb_muscle_ros.mechanisms.detachment.forcible import ForcibleDetachment
from xb_muscle_ros.mechanisms.detachment.regular import RegularDetachment
from xb_muscle_ros.mechanisms.force_velocity.logarithmic import LogarithmicForceVelocity
from xb_muscle_ros.mechanisms.lumped import Activation, ForceVelocity
from xb_muscle_ros.mechanisms.parallel.linear import LinearParallel
from xb_muscle_ros.mechanisms.parallel.softplus import SoftplusParallel
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.series.rigid import RigidSeries
from xb_muscle_ros.mechanisms.thick_filament.always_on import AlwaysOnThickFilament
from xb_muscle_ros.mechanisms.thick_filament.force_dependent import ForceDependentThickFilament
from xb_muscle_ros.mechanisms.thin_filament.cooperative import CooperativeThinFilament
from xb_muscle_ros.mechanisms.thin_filament.sigmoid import SigmoidThinFilament
from xb_muscle_ros.models.composition import Composition, Model
from xb_muscle_ros.models.hill import Hill


class Row(NamedTuple):
    """The blocks of a cross-bridge model, one of each family; the defaults are those of the paper's."""

    thin_filament: type[ThinFilament]
    thick_filament: type[ThickFilament]
    attachment: type[Attachment] = GaussianAttachment
    detachment: type[Detachment] = RegularDetachment
    series: type[Series] = ExponentialSeries
    parallel: type[Parallel] = LinearParallel

    def composed(self, name: str, method: type[Representation]) -> Model:
        """The model, with a representation of the heads' strain."""
        return Composition(
            name=f"{name}_{method.name}",
            thin_filament=self.thin_filament(),
            thick_filament=self.thick_filament(),
            attachment=self.attachment(),
            detachment=self.detachment(),
            series=self.series(),
            parallel=self.parallel(),
            representation=method(),
        )


class HillRow(NamedTuple):
    """The blocks of a model without cross-bridges."""

    activation: type[Activation]
    force_velocity: type[ForceVelocity]
    series: type[Series] = ExponentialSeries
    parallel: type[Parallel] = LinearParallel

    def composed(self, name: str, method: type[Representation]) -> Model:
        """The model; it has no heads whose strain could be represented in one way or another."""
        return Hill(
            name=name,
            activation=self.activation(),
            force_velocity=self.force_velocity(),
            series=self.series(),
            parallel=self.parallel(),
        )


_BASES: Mapping[str, Row | HillRow] = {
    "2state": Row(SigmoidThinFilament, AlwaysOnThickFilament),
    "2state_coop": Row(CooperativeThinFilament, AlwaysOnThickFilament),
    "3state_coop": Row(CooperativeThinFilament, ForceDependentThickFilament),
    "4state_coop": Row(CooperativeThinFilament, ForceDependentThickFilament, detachment=ForcibleDetachment),
    "hill_se": HillRow(SigmoidActivation, LogarithmicForceVelocity),
}
# Every base also comes with these blocks in place of its own, named by suffixes in this order.
_MODIFIERS: Mapping[str, Mapping[str, type]] = {
    "rigid": {"series": RigidSeries},
    "softplus": {"parallel": SoftplusParallel},
}
# What the field calls a base with its first suffix.
_KNOWN_AS = {"hill_se_rigid": "hill"}


def _variants() -> Iterator[tuple[str, str, Row | HillRow]]:
    """Name, base and blocks of every model, bases first."""
    for chosen in sorted(product((False, True), repeat=len(_MODIFIERS))):
        suffixes = [suffix for suffix, wanted in zip(_MODIFIERS, chosen, strict=True) if wanted]
        for base, row in _BASES.items():
            name = "_".join([base, *suffixes])
            for long, short in _KNOWN_AS.items():
                name = short + name.removeprefix(long) if name.startswith(long) else name
            changes: dict[str, Any] = {}
            for suffix in suffixes:
                changes |= _MODIFIERS[suffix]
            yield name, base, row._replace(**changes)


MODELS: Mapping[str, Row | HillRow] = MappingProxyType({name: row for name, _, row in _variants()})
BASE_OF: Mapping[str, str] = MappingProxyType({name: base for name, base, _ in _variants()})
"""Model whose parameter set a model can use: itself, or the one that it is a variant of."""
METHODS: Mapping[str, type[Representation]] = {
    method.name: method for method in (Gaussian, Characteristics, FixedGrid, ConservativeFixedGrid)
}


def split_set(name: str, where: str = "") -> tuple[str, str]:
    """Model that a parameter set belongs to, and its version: '3state_coop_v3' is ('3state_coop', '_v3').

    Args:
        name: of the set: that of a model, or with ``_v`` and a number behind.
        where: begins the message; a file, say.

    Raises:
        UserError: no such model; the nearest name is suggested.
    """
    stem, _, version = name.rpartition("_v")
    model = stem if stem and version.isdigit() else name
    if model not in MODELS:
        raise UserError(f"{where}{': ' if where else ''}model '{name}' is not known{suggest(name, MODELS)}")
    return model, name[len(model) :]


def model_of_set(name: str, where: str = "") -> str:
    """Model that a parameter set of a fibre file belongs to: see `split_set`."""
    return split_set(name, where)[0]


def compose(model: str, method: str = "gaussian") -> Model:
    """Build the named model for the named method.

    Raises:
        UserError: model or method unknown.
    """
    if method not in METHODS:
        raise UserError(f"method '{method}' is not known{suggest(method, METHODS)}")
    name = model_of_set(model)
    return MODELS[name].composed(name, METHODS[method])
