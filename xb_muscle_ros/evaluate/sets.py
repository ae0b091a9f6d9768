"""Which parameter sets are evaluated: what fibre files have, what they lack, how sets came about, and their order."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, base_set, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import base_of, compose, model_of_set

ORDER = ("hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop")
"""Models by the number of their states, simplest first (van der Zee et al. 2026)."""
REFERENCE_OF_AIC = "hill"
_NAMES = {
    "hill": "Hill (no SE)",
    "hill_se": "Hill (with SE)",
    "2state": "2-state XB",
    "2state_coop": "2-state XB coop",
    "3state_coop": "3-state XB coop",
    "4state_coop": "4-state XB coop",
}
# What was fitted for each fibre (van der Zee et al. 2026, Methods); the rest came from the literature.
_FITTED = frozenset(
    "f k11 k21 k22 dLcrit kon koop kappa n JF vmax kpe Fpe0 kse kse0".split()  # noqa: SIM905 - reads as the paper has it
)


@dataclass(frozen=True)
class ModelSet:
    """A parameter set by name over all fibres of a run.

    Attributes:
        name: of the set, for example ``3state_coop_v3``.
        fibres: fibre name -> the fibre with this set; those whose file lacks it are left out.
        missing: names of the fibres whose file lacks it.
        borrowed_from: the base whose set is used because there is none of this name (``hill`` from ``hill_se``); None
            for a set of its own.
    """

    name: str
    fibres: Mapping[str, Fibre]
    missing: tuple[str, ...]
    borrowed_from: str | None

    @property
    def title(self) -> str:
        """What figures and tables call it."""
        model = model_of_set(self.name)
        return _NAMES.get(model, model) + self.name[len(model) :].replace("_", " ")

    @property
    def rank(self) -> int:
        """Place in `ORDER`; variants stand where their base does."""
        return rank(self.name)

    @property
    def fitted_parameters(self) -> int:
        """Number of parameters that were fitted for each fibre: k of the AIC."""
        return sum(row.name in _FITTED for row in compose(self.name).parameters)

    def provenance(self) -> dict[str, str]:
        """How the set of each fibre was obtained, in the fibre file's words."""
        note = f"; set of {self.borrowed_from}, not fitted for this model" if self.borrowed_from else ""
        return {name: (fibre.source or "the fibre file does not say") + note for name, fibre in self.fibres.items()}


def rank(set_name: str) -> int:
    """Place of a set's model in `ORDER`."""
    model = model_of_set(set_name)
    return ORDER.index(model if model in ORDER else base_of(model))


def gather(fibres: Sequence[str | Path], models: Sequence[str] | None, method: str | None) -> list[ModelSet]:
    """Sets of all fibres, simplest model first.

    Args:
        fibres: names or files; at least one.
        models: names of sets; every set that one of the files has where None.
        method: see `load_fibre`.

    Raises:
        UserError: see `load_fibre`; a fibre named twice; a set that no fibre has.
    """
    files: dict[str, tuple[str | Path, tuple[str, ...]]] = {}
    for fibre in fibres:
        held = load_fibre(fibre, None, method)
        if held.name in files:
            raise UserError(f"fibre {held.name} is given twice, by {files[held.name][0]} and {fibre}; give each once")
        files[held.name] = (fibre, held.available_models)
    known = sorted({name for _, available in files.values() for name in available})
    wanted = list(dict.fromkeys(models if models is not None else known))
    gathered = [_gathered(name, files, method) for name in sorted(wanted, key=lambda name: (rank(name), name))]
    for each in gathered:
        if not each.fibres:
            raise UserError(
                f"model '{each.name}': none of the fibres {', '.join(files)} has a parameter set; there are "
                f"{', '.join(known)}"
            )
    return gathered


def _gathered(name: str, files: Mapping[str, tuple[str | Path, tuple[str, ...]]], method: str | None) -> ModelSet:
    base = base_set(name)
    own = {fibre for fibre, (_, available) in files.items() if name in available}
    # One source for all fibres: a set of its own where any fibre has one, its base's for none or all of them.
    borrowed = base if not own and base != name else None
    having = own or {fibre for fibre, (_, available) in files.items() if base in available}
    loaded = {fibre: load_fibre(files[fibre][0], name, method) for fibre in files if fibre in having}
    missing = tuple(fibre for fibre in files if fibre not in having)
    return ModelSet(name, MappingProxyType(loaded), missing, borrowed)


def fibre_to_task(fibre: Fibre) -> dict[str, Any]:
    """A fibre as JSON, whole: a worker elsewhere needs no file, and a changed parameter makes another task."""
    return {
        "name": fibre.name,
        "model": fibre.model,
        "method": fibre.method,
        "values": dict(fibre.values),
        "reference_length_m": fibre.reference_length_m,
        "f0_n": fibre.f0_n,
    }


def muscle_of_task(task: Mapping[str, Any]) -> Muscle:
    """The fibre of `fibre_to_task`, ready to step; a process keeps the last few."""
    return _muscle(json.dumps(task, sort_keys=True))


@functools.lru_cache(maxsize=64)
def _muscle(text: str) -> Muscle:
    held = json.loads(text)
    held["values"] = MappingProxyType(held["values"])
    return Muscle(Fibre(**held, source="", path=None, available_models=()))
