"""Named models: each a row of blocks. A new mechanism adds its file, and one row here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from xb_muscle_ros.distribution.base import Representation
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.distribution.grid import Characteristics, ConservativeFixedGrid, FixedGrid
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms.attachment.gaussian import GaussianAttachment
from xb_muscle_ros.mechanisms.base import Attachment, Detachment, Parallel, Series, ThickFilament, ThinFilament
from xb_muscle_ros.mechanisms.detachment.regular import RegularDetachment
from xb_muscle_ros.mechanisms.parallel.linear import LinearParallel
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.thick_filament.always_on import AlwaysOnThickFilament
from xb_muscle_ros.mechanisms.thick_filament.force_dependent import ForceDependentThickFilament
from xb_muscle_ros.mechanisms.thin_filament.cooperative import CooperativeThinFilament
from xb_muscle_ros.mechanisms.thin_filament.sigmoid import SigmoidThinFilament
from xb_muscle_ros.models.composition import Composition


class Row(NamedTuple):
    """The blocks of a model, one of each family; the defaults are those of the paper's cross-bridge models."""

    thin_filament: type[ThinFilament]
    thick_filament: type[ThickFilament]
    attachment: type[Attachment] = GaussianAttachment
    detachment: type[Detachment] = RegularDetachment
    series: type[Series] = ExponentialSeries
    parallel: type[Parallel] = LinearParallel


MODELS: Mapping[str, Row] = {
    "2state": Row(SigmoidThinFilament, AlwaysOnThickFilament),
    "2state_coop": Row(CooperativeThinFilament, AlwaysOnThickFilament),
    "3state_coop": Row(CooperativeThinFilament, ForceDependentThickFilament),
}
METHODS: Mapping[str, type[Representation]] = {
    method.name: method for method in (Gaussian, Characteristics, FixedGrid, ConservativeFixedGrid)
}


def model_of_set(name: str, where: str = "") -> str:
    """Model that a parameter set of a fibre file belongs to: its name up to ``_v`` and a version number.

    Args:
        name: of the set.
        where: begins the message; a file, say.

    Raises:
        UserError: no such model; the nearest name is suggested.
    """
    stem, _, version = name.rpartition("_v")
    model = stem if stem and version.isdigit() else name
    if model not in MODELS:
        raise UserError(f"{where}{': ' if where else ''}model '{name}' is not known{suggest(name, MODELS)}")
    return model


def compose(model: str, method: str = "gaussian") -> Composition:
    """Build the named model for the named method.

    Raises:
        UserError: model or method unknown.
    """
    if method not in METHODS:
        raise UserError(f"method '{method}' is not known{suggest(method, METHODS)}")
    name = model_of_set(model)
    row = MODELS[name]
    return Composition(
        name=f"{name}_{method}",
        thin_filament=row.thin_filament(),
        thick_filament=row.thick_filament(),
        attachment=row.attachment(),
        detachment=row.detachment(),
        series=row.series(),
        parallel=row.parallel(),
        representation=METHODS[method](),
    )
