"""Isometric force of a fibre against calcium: its scale, and the calcium of an activation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.passive import without_own
from xb_muscle_ros.models.registry import SEPARATOR, with_mechanisms
from xb_muscle_ros.plant.mjcf.table import Choice
from xb_muscle_ros.plant.plant import Array

RELATIONS = ("active_force_length", "passive_force_length")
"""Mechanisms that every muscle's model gets."""
FULL_PCA, RELAXED_PCA = 4.5, 8.0
"""Calcium of full activation, where one F0 is measured, and calcium below which activation grows in proportion."""
POINTS = 1025
"""Of a table of calcium by activation."""
_FIRST_POINTS, _LARGEST_RISE, _MOST_POINTS = 36, 0.01, 2000


@dataclass(frozen=True, eq=False)
class Calibration:
    """A fibre of which one F0 is what it pulls isometrically at `FULL_PCA`.

    Attributes:
        fibre: with `RELATIONS`, without a parallel element, and with ``Fscale`` set.
        calcium_um: for activations of 0 to 1 in equal steps, shape (`POINTS`,), µM.
        least: activation without calcium: 0, but for Hill-type models, which have a floor.
    """

    fibre: Fibre
    calcium_um: Array
    least: float


def bare_model(model: str) -> str:
    """A model without `RELATIONS`, which every muscle gets."""
    name, *mechanisms = model.split(SEPARATOR)
    return with_mechanisms(name, *(m for m in mechanisms if m not in RELATIONS))


def bridged_model(model: str) -> str:
    """A model as a muscle has it, with `RELATIONS`."""
    return with_mechanisms(bare_model(model), *RELATIONS)


def calibrated(choice: Choice, where: str) -> Calibration:
    """Settle a fibre at rest length over all calcium, and turn force against calcium round.

    The fibre's own parallel element is left out: it was fitted to stretches of 4 % L0, and passive force is that of the
    muscle.

    Args:
        choice: of fibre, model, method and parameters.
        where: begins messages.

    Raises:
        UserError: unknown fibre, model or parameter, or force does not grow with calcium.
    """
    bare = bare_model(choice.model)
    if "Fscale" in choice.parameters:
        raise UserError(
            f"{where}: Fscale is set such that the fibre pulls with one F0 when it is fully active; leave it out, and "
            "change the muscle's force in the model"
        )
    try:
        fibre = load_fibre(choice.fibre, bare, choice.method, values=choice.parameters)
    except UserError as error:
        raise UserError(f"{where}: {error}") from error
    fibre = changed(fibre, {**without_own(fibre.values), **choice.parameters}, where)
    muscle = Muscle(fibre)

    def force(calcium_um: float) -> float:
        return muscle.outputs(muscle.settle(0.0, calcium_um)).force_ce_f0

    full = force(_um(FULL_PCA))
    if not full > 0.0:
        raise UserError(
            f"{where}: fibre {fibre.name}, model {fibre.model} pulls with {full:.3g} F0 at pCa {FULL_PCA:g}"
        )
    whole = load_fibre(choice.fibre, bridged_model(bare), choice.method, values=choice.parameters)
    whole = changed(whole, {**fibre.values, "Fscale": fibre.values["Fscale"] / full}, where)
    pca = list(np.linspace(RELAXED_PCA, FULL_PCA, _FIRST_POINTS))
    share = [force(_um(value)) / full for value in pca]
    k = 1
    while k < len(pca):
        # Force rises by a tenth within a twentieth of a pCa where activation is cooperative.
        if share[k] - share[k - 1] > _LARGEST_RISE and len(pca) < _MOST_POINTS:
            pca.insert(k, (pca[k - 1] + pca[k]) / 2.0)
            share.insert(k, force(_um(pca[k])) / full)
        else:
            k += 1
    least = max(force(0.0) / full, 0.0)
    calcium = _turned_round(np.array(pca), np.array(share), least, f"{where}: {fibre.model}")
    return Calibration(whole, calcium, least)


def _um(pca: float) -> float:
    return float(10.0 ** (6.0 - pca))


def _turned_round(pca: Array, share: Array, none: float, where: str) -> Array:
    """Calcium (µM) at equally spaced activations; below the first point in proportion, above it monotone in pCa."""
    fall = np.flatnonzero(np.diff(share) < -1e-6)
    if fall.size:
        at = pca[fall[0]]
        raise UserError(f"{where}: isometric force falls with calcium from pCa {at:.2f} on; no activation leads to it")
    kept = np.concatenate(([True], np.diff(np.maximum.accumulate(share)) > 1e-9))
    # The last point is full activation, whatever rounding does.
    kept[-1] = True
    pca, share = pca[kept], share[kept]
    wanted = np.linspace(0.0, 1.0, POINTS)
    log_calcium = PchipInterpolator(share, 6.0 - pca)(np.maximum(wanted, share[0]))
    first = _um(float(pca[0]))
    near = first * np.clip((wanted - none) / max(float(share[0]) - none, 1e-12), 0.0, 1.0)
    found: Array = np.where(wanted < share[0], near, 10.0**log_calcium)
    return found
