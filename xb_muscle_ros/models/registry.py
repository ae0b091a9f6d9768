"""Named models: each a row of blocks. A new mechanism adds its file, and one row here."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.distribution.base import MomentRepresentation
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.mechanisms.attachment.gaussian import GaussianAttachment
from xb_muscle_ros.mechanisms.detachment.regular import RegularDetachment
from xb_muscle_ros.mechanisms.parallel.linear import LinearParallel
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.thick_filament.always_on import AlwaysOnThickFilament
from xb_muscle_ros.mechanisms.thick_filament.force_dependent import ForceDependentThickFilament
from xb_muscle_ros.mechanisms.thin_filament.cooperative import CooperativeThinFilament
from xb_muscle_ros.mechanisms.thin_filament.sigmoid import SigmoidThinFilament
from xb_muscle_ros.models.composition import Composition

# thin filament, thick filament, attachment, detachment, series, parallel
_COMMON = (GaussianAttachment, RegularDetachment, ExponentialSeries, LinearParallel)
MODELS: Mapping[str, tuple[type, ...]] = {
    "2state": (SigmoidThinFilament, AlwaysOnThickFilament, *_COMMON),
    "2state_coop": (CooperativeThinFilament, AlwaysOnThickFilament, *_COMMON),
    "3state_coop": (CooperativeThinFilament, ForceDependentThickFilament, *_COMMON),
}
METHODS: Mapping[str, type[MomentRepresentation]] = {"gaussian": Gaussian}


def model_of_set(name: str) -> str:
    """Model that a parameter set of a fibre file belongs to: its name up to ``_v`` and a version number.

    Raises:
        UserError: no such model; the nearest name is suggested.
    """
    stem, _, version = name.rpartition("_v")
    model = stem if stem and version.isdigit() else name
    if model not in MODELS:
        raise UserError(f"model '{name}' is not known{suggest(name, MODELS)}")
    return model


def compose(model: str, method: str = "gaussian") -> Composition:
    """Build the named model for the named method.

    Raises:
        UserError: model or method unknown.
    """
    if method not in METHODS:
        raise UserError(f"method '{method}' is not known{suggest(method, METHODS)}")
    blocks = [block() for block in MODELS[model_of_set(model)]]
    return Composition(f"{model_of_set(model)}_{method}", *blocks, representation=METHODS[method]())
