"""Named models: each a row of blocks. A new mechanism adds its file, and one row here.

A name is that of a model, and behind it any number of mechanisms: ``3state_coop+viscous_drag+active_titin``.
"""

from __future__ import annotations

import functools
import hashlib
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
from xb_muscle_ros.mechanisms.extra import Extra, Needs
from xb_muscle_ros.mechanisms.extras.active_titin import ActiveTitin
from xb_muscle_ros.mechanisms.extras.filament_friction import FilamentFriction
from xb_muscle_ros.mechanisms.extras.filament_overlap import FilamentOverlap
from xb_muscle_ros.mechanisms.extras.half_sarcomere_spread import HalfSarcomereSpread
from xb_muscle_ros.mechanisms.extras.lattice_spacing import LatticeSpacing
from xb_muscle_ros.mechanisms.extras.length_dependent_activation import LengthDependentActivation
from xb_muscle_ros.mechanisms.extras.nonlinear_crossbridge import NonlinearCrossbridge
from xb_muscle_ros.mechanisms.extras.passive_viscoelasticity import PassiveViscoelasticity
from xb_muscle_ros.mechanisms.extras.persistent_thick_filament import PersistentThickFilament
from xb_muscle_ros.mechanisms.extras.phosphate import Phosphate
from xb_muscle_ros.mechanisms.extras.static_calcium_stiffness import StaticCalciumStiffness
from xb_muscle_ros.mechanisms.extras.strain_recruited_heads import StrainRecruitedHeads
from xb_muscle_ros.mechanisms.extras.temperature import Temperature
from xb_muscle_ros.mechanisms.extras.viscous_drag import ViscousDrag
from xb_muscle_ros.mechanisms.extras.weakly_bound_heads import WeaklyBoundHeads
from xb_muscle_ros.mechanisms.force_velocity.logarithmic import LogarithmicForceVelocity
from xb_muscle_ros.mechanisms.lumped import Activation, ForceVelocity
from xb_muscle_ros.mechanisms.parallel.linear import LinearParallel
from xb_muscle_ros.mechanisms.parallel.softplus import SoftplusParallel
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.series.rigid import RigidSeries
from xb_muscle_ros.mechanisms.series.slack import SlackSeries
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
    extras: tuple[type[Extra], ...] = ()

    @property
    def has(self) -> frozenset[Needs]:
        """What mechanisms can act on."""
        super_relaxed = self.thick_filament is not AlwaysOnThickFilament
        return frozenset({Needs.NOTHING, Needs.HEADS} | ({Needs.SUPER_RELAXED} if super_relaxed else set()))

    def composed(self, name: str, method: type[Representation]) -> Model:
        """The model, with a representation of the heads' strain."""
        return Composition(
            name=f"{_same_as(self, name)}_{method.name}",
            thin_filament=self.thin_filament(),
            thick_filament=self.thick_filament(),
            attachment=self.attachment(),
            detachment=self.detachment(),
            series=self.series(),
            parallel=self.parallel(),
            representation=method(),
            extras=tuple(extra() for extra in self.extras),
        )


class HillRow(NamedTuple):
    """The blocks of a model without cross-bridges."""

    activation: type[Activation]
    force_velocity: type[ForceVelocity]
    series: type[Series] = ExponentialSeries
    parallel: type[Parallel] = LinearParallel
    extras: tuple[type[Extra], ...] = ()

    @property
    def has(self) -> frozenset[Needs]:
        """What mechanisms can act on."""
        return frozenset({Needs.NOTHING})

    def composed(self, name: str, method: type[Representation]) -> Model:
        """The model; it has no heads whose strain could be represented in one way or another."""
        return Hill(
            name=_same_as(self, name),
            activation=self.activation(),
            force_velocity=self.force_velocity(),
            series=self.series(),
            parallel=self.parallel(),
            extras=tuple(extra() for extra in self.extras),
        )


# Of a compiled module's name; the rest is a hash.
_LONGEST = 120


def _same_as(row: Row | HillRow, name: str) -> str:
    """Name of the compiled module: models of the same blocks share it, whatever they are called."""
    bare = row._replace(extras=())
    own = "_with_".join(part for part in name.split(SEPARATOR) if part not in EXTRAS)
    same = next((known for known, blocks in MODELS.items() if blocks == bare), own)
    named = "_with_".join([same, *(extra.name for extra in row.extras)])
    # File systems allow names of 255 bytes.
    return named if len(named) <= _LONGEST else f"{named[:_LONGEST]}_{hashlib.sha256(named.encode()).hexdigest()[:8]}"


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
    "slack": {"series": SlackSeries},
    "softplus": {"parallel": SoftplusParallel},
}
# What the field calls a base with its first suffix.
_KNOWN_AS = {"hill_se_rigid": "hill"}


def _variants() -> Iterator[tuple[str, str, Row | HillRow]]:
    """Name, base and blocks of every model, bases first."""
    for chosen in sorted(product((False, True), repeat=len(_MODIFIERS))):
        suffixes = [suffix for suffix, wanted in zip(_MODIFIERS, chosen, strict=True) if wanted]
        blocks = [slot for suffix in suffixes for slot in _MODIFIERS[suffix]]
        if len(blocks) > len(set(blocks)):
            continue
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
SEPARATOR = "+"
"""Between a model's name and those of the mechanisms that come with it."""
EXTRAS: Mapping[str, type[Extra]] = MappingProxyType(
    {
        extra.name: extra
        for extra in (
            ViscousDrag,
            PassiveViscoelasticity,
            WeaklyBoundHeads,
            ActiveTitin,
            StaticCalciumStiffness,
            LengthDependentActivation,
            LatticeSpacing,
            FilamentOverlap,
            StrainRecruitedHeads,
            PersistentThickFilament,
            FilamentFriction,
            NonlinearCrossbridge,
            HalfSarcomereSpread,
            Temperature,
            Phosphate,
        )
    }
)
"""Mechanisms that come on top of a model's blocks."""
SWAPS: Mapping[str, Mapping[str, type]] = MappingProxyType(
    {
        "series_compliance": {"series": ExponentialSeries},
        "thin_filament_cooperativity": {"thin_filament": CooperativeThinFilament},
        "thick_filament_cooperativity": {"thick_filament": ForceDependentThickFilament},
        "forcible_detachment": {"detachment": ForcibleDetachment},
    }
)
"""Mechanisms that take the place of a block of the model."""


def _with_mechanism(row: Row | HillRow, name: str, where: str) -> Row | HillRow:
    """A row with one more mechanism.

    Raises:
        UserError: unknown, there already, or with nothing in the model to act on.
    """
    if name in EXTRAS:
        extra = EXTRAS[name]
        if extra in row.extras:
            raise UserError(f"{where}: mechanism '{name}' is named twice; name it once")
        if extra.needs not in row.has:
            raise UserError(f"{where}: mechanism '{name}' needs {extra.needs.value}, which this model does not have")
        return row._replace(extras=(*row.extras, extra))
    if name in SWAPS:
        for slot, block in SWAPS[name].items():
            if slot not in row._fields:
                raise UserError(
                    f"{where}: mechanism '{name}' needs {Needs.HEADS.value}, which this model does not have"
                )
            if getattr(row, slot) is block:
                raise UserError(f"{where}: mechanism '{name}' is part of this model already; leave it out")
        swapped: dict[str, Any] = dict(SWAPS[name])
        return row._replace(**swapped)
    raise UserError(f"{where}: mechanism '{name}' is not known{suggest(name, (*EXTRAS, *SWAPS))}")


@functools.cache
def row_of(model: str) -> Row | HillRow:
    """Blocks of a model with its mechanisms.

    Raises:
        UserError: see `split_set`.
    """
    stem, *mechanisms = model.split(SEPARATOR)
    row = MODELS[stem]
    for name in mechanisms:
        row = _with_mechanism(row, name, f"model '{model}'")
    return row


def base_of(model: str) -> str:
    """Model whose parameter set a model can start from, without mechanisms: see `BASE_OF`."""
    return BASE_OF[model.split(SEPARATOR)[0]]


def with_mechanisms(name: str, *mechanisms: str) -> str:
    """Name of a set or model with more mechanisms."""
    return SEPARATOR.join([name, *mechanisms])


METHODS: Mapping[str, type[Representation]] = {
    method.name: method for method in (Gaussian, Characteristics, FixedGrid, ConservativeFixedGrid)
}


def split_set(name: str, where: str = "") -> tuple[str, str]:
    """Model that a parameter set belongs to, and its version: '3state_coop_v3' is ('3state_coop', '_v3').

    Args:
        name: of the set: that of a model, or with ``_v`` and a number behind; then its mechanisms.
        where: begins the message; a file, say.

    Raises:
        UserError: no such model or mechanism, or none that goes with the model; the nearest name is suggested.
    """
    whole, *mechanisms = name.split(SEPARATOR)
    stem, _, version = whole.rpartition("_v")
    plain = stem if stem and version.isdigit() else whole
    if plain not in MODELS:
        raise UserError(f"{where}{': ' if where else ''}model '{plain}' is not known{suggest(plain, MODELS)}")
    model = with_mechanisms(plain, *mechanisms)
    row_of(model)
    return model, whole[len(plain) :]


def model_of_set(name: str, where: str = "") -> str:
    """Model that a parameter set of a fibre file belongs to: see `split_set`."""
    return split_set(name, where)[0]


PUSHES_F0 = -1e-3
"""Force below it, F0, is a push; rounding of a slack fibre stays above."""


def slack_of(name: str) -> str | None:
    """Set or model of the same blocks whose series spring goes slack; None where it does already.

    Raises:
        UserError: see `split_set`.
    """
    model, version = split_set(name)
    stem, *mechanisms = model.split(SEPARATOR)
    if row_of(model).series is SlackSeries:
        return None
    wanted = MODELS[stem]._replace(series=SlackSeries)
    slack = next(known for known, row in MODELS.items() if row == wanted)
    return with_mechanisms(slack + version, *mechanisms)


def compose(model: str, method: str = "gaussian") -> Model:
    """Build the named model for the named method.

    Raises:
        UserError: model or method unknown.
    """
    if method not in METHODS:
        raise UserError(f"method '{method}' is not known{suggest(method, METHODS)}")
    name = model_of_set(model)
    return row_of(name).composed(name, METHODS[method])
