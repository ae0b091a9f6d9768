"""Which parameter sets are evaluated: what fibre files have, what they lack, how sets came about, and their order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import FITTED_BY_THE_PAPER
from xb_muscle_ros.models.catalogue import without_effect_line
from xb_muscle_ros.models.fibre_file import Fibre, base_set, find_fibre_file, load_fibre
from xb_muscle_ros.models.registry import base_of, compose, model_of_set
from xb_muscle_ros.models.strain_bins import wide_bins_line
from xb_muscle_ros.models.titles import title_of

ORDER = ("hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop")
"""Models by the number of their states, simplest first (van der Zee et al. 2026)."""
REFERENCE_OF_AIC = "hill"


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
        return title_of(self.name)

    @property
    def rank(self) -> int:
        """Place in `ORDER`; variants stand where their base does."""
        return rank(self.name)

    @property
    def fitted_parameters(self) -> int:
        """Number of parameters that the paper fitted for each fibre: k of the AIC."""
        return sum(row.name in FITTED_BY_THE_PAPER for row in compose(self.name).parameters)

    def provenance(self) -> dict[str, str]:
        """How the set of each fibre was obtained, in the fibre file's words."""
        note = f"; set of {self.borrowed_from}, not fitted for this model" if self.borrowed_from else ""
        return {name: (fibre.source or "the fibre file does not say") + note for name, fibre in self.fibres.items()}


class NoFibreFile(UserError):
    """No fibre file serves a trial.

    Attributes:
        fibre: of the trial.
    """

    def __init__(self, fibre: str, message: str) -> None:
        super().__init__(message)
        self.fibre = fibre


def file_serving(files: Mapping[str, str | Path] | None, fibre: str) -> Path:
    """Fibre file whose parameters serve a trial; see `served_line` for what there is to say of it.

    That of its fibre's name; else, as in a replay, the one file that was given.

    Args:
        files: that were given, by the fibre's name; None: those of the package.

    Raises:
        NoFibreFile: several were given and none is the fibre's, or none was given and the package has none.
    """
    if files is None:
        try:
            return find_fibre_file(fibre)
        except UserError as error:
            raise NoFibreFile(fibre, f"{error}; give a fibre file with --fiber") from error
    if fibre in files:
        return Path(files[fibre])
    if len(files) == 1:
        return Path(next(iter(files.values())))
    raise NoFibreFile(
        fibre, f"the bag's fibre is '{fibre}', the fibre files given are of {', '.join(files)}; give its file too"
    )


def served_line(files: Mapping[str, str | Path] | None, fibres: Sequence[str]) -> str:
    """One line on trials that another fibre's parameters serve; empty where there are none."""
    others = [name for name in fibres if files is not None and name not in files]
    if files is None or not others:
        return ""
    return (
        f"trials of fibre {', '.join(others)} are compared with parameters of {next(iter(files))}, the one file given"
    )


def value_lines(models: Sequence[ModelSet]) -> list[str]:
    """For each set with mechanisms whose effect is exactly zero in a fibre, or with bins too wide, one line."""
    lines = []
    for each in models:
        told = {name: without_effect_line(each.name, fibre.values) for name, fibre in each.fibres.items()}
        for line in dict.fromkeys(line for line in told.values() if line):
            named = ", ".join(name for name, text in told.items() if text == line)
            # Values are not given on the command line here.
            lines.append(f"model {each.name}, fibre {named}: {line.partition('; ')[0]}; fit it first")
        wide = {name: wide_bins_line(fibre.values) for name, fibre in each.fibres.items()}
        for line in dict.fromkeys(line for line in wide.values() if line):
            named = ", ".join(name for name, text in wide.items() if text == line)
            lines.append(f"model {each.name}, fibre {named}: {line}")
    return lines


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
