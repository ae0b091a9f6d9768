"""Fibres to draw truths around: numbers of the package's fibre files, read as plain YAML."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import installed_folders

# SD of the logarithm of a truth's constants around those of the file, at most; others are as in the file.
_SPREAD = {
    "f": 0.25, "k11": 0.25, "k21": 0.25, "k22": 0.2, "kon": 0.2, "koop": 0.25, "JF": 0.25, "kse": 0.2, "kse0": 0.25,
    "kpe": 0.25, "kappa": 0.1, "n": 0.1,
}  # fmt: skip
_LEAST_SPREAD = 0.6
_KEPT = (*_SPREAD, "koff", "J1", "J2", "w", "k12", "Fpe0", "gamma", "Fscale")
# Sets whose constants lie where no fibre does: no detachment on one side, or nearly no slope.
_UNUSUAL = {("13Dec2017a", "2state"), ("12Dec2017a", "2state_coop"), ("19Dec2017a", "2state_coop")}


def fibres_with(model: str) -> list[str]:
    """Names of the fibres whose files have a usual set of a model (a variant's is its base's).

    Raises:
        UserError: no fibre file is found.
    """
    base = model.removesuffix("_rigid")
    return [name for name, sets in sorted(_files().items()) if base in sets and (name, base) not in _UNUSUAL]


def nominal(fibre: str, model: str) -> dict[str, float]:
    """Constants of a fibre for a model, with an exact (not smoothed) form understood.

    Raises:
        UserError: there is no such fibre or set.
    """
    base = model.removesuffix("_rigid")
    sets = _files().get(fibre, {})
    if base not in sets:
        raise UserError(f"fibre {fibre} has no set for {model}; there are {', '.join(sets) or 'none'}")
    no_use = ("kse", "kse0") if model != base else ()
    return {name: float(value) for name, value in sets[base].items() if name in _KEPT and name not in no_use}


def drawn_around(values: Mapping[str, float], random: np.random.Generator) -> dict[str, float]:
    """A fibre like another: log-normal around its constants."""
    width = random.uniform(_LEAST_SPREAD, 1.0)
    return {
        name: float(value * np.exp(width * _SPREAD.get(name, 0.0) * random.standard_normal()))
        for name, value in values.items()
    }


def fibre_text(name: str, model: str, method: str, values: Mapping[str, float]) -> str:
    """Text of the fibre file that goes with a case."""
    inner = {
        "fibre": name,
        "model": model,
        "method": method,
        "source": "fitted to another fibre of this kind",
        "constants": {"reference_length_m": 1.0, "f0_n": 1.0},
        "models": {model: {**{key: float(f"{value:.6g}") for key, value in values.items()}, "smoothing": 0.0}},
    }
    return yaml.safe_dump({"/**": {"ros__parameters": inner}}, sort_keys=False)


_found: dict[str, dict[str, dict[str, float]]] = {}


def _files() -> dict[str, dict[str, dict[str, float]]]:
    """Parameter sets of every fibre file, read once."""
    if not _found:
        for folder in installed_folders("config", "fibers"):
            for file in sorted(folder.glob("*.yaml")):
                tree = fast_yaml.load(file.read_text(encoding="utf-8"))
                _found.setdefault(file.stem, tree["/**"]["ros__parameters"]["models"])
    if not _found:
        raise UserError("no fibre files are found beside the package; install it whole")
    return _found
