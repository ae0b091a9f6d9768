"""A fibre file to start from: a published parameter set, and what is known of one's own fibre.

Nothing is invented: what is not given stays as published, and a comment says so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.files import refuse_older, replaced
from xb_muscle_ros.mechanisms.extras.temperature import Q10, RATES
from xb_muscle_ros.models.fibre_file import Fibre, fibre_folders, find_fibre_file, load_fibre
from xb_muscle_ros.models.fibre_writing import fibre_text
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.parameters import PARAMETERS, checked
from xb_muscle_ros.trials.readers.plausibility import STRESS_PA

# What all fibres of the package are; the first line of each of their files says it.
SPECIES, MUSCLE, TEMPERATURE_C = "rat", "soleus", 22.0
TEMPERATURES_C = (0.0, 45.0)
_COMPARED = "3state_coop"
_ACTIVE_PCA, _RELAXED_PCA = 4.5, 9.0


@dataclass(frozen=True)
class KnownOfFibre:
    """What is known of a fibre.

    Attributes:
        reference_length_m: L0, m.
        f0_n: F0, N.
        area_m2: cross-section, m².
        temperature_c: of the experiments, °C.
        species, muscle: in words.
        q10: factor of all rates per 10 K; None to leave rates at the temperature of the published set.
    """

    reference_length_m: float | None = None
    f0_n: float | None = None
    area_m2: float | None = None
    temperature_c: float | None = None
    species: str | None = None
    muscle: str | None = None
    q10: float | None = None


def middle_fibre(model: str | None = None) -> str:
    """Of the package's fibres the one whose parameters are nearest to the median of all, as logarithms.

    Args:
        model: compare sets of this model, where any fibre has one; None for the paper's own.
    """
    every = {file.stem: load_fibre(file) for folder in fibre_folders() for file in sorted(folder.glob("*.yaml"))}
    having = [name for name, fibre in every.items() if model in fibre.available_models]
    compared = model if having else _COMPARED
    names = sorted(having or [name for name, fibre in every.items() if _COMPARED in fibre.available_models])
    values = [load_fibre(name, compared).values for name in names]
    shown = [key for key in values[0] if all(each[key] > 0.0 for each in values)]
    logs = np.log([[each[key] for key in shown] for each in values])
    return names[int(np.argmin(np.abs(logs - np.median(logs, axis=0)).sum(axis=1)))]


def make_fibre(
    path: Path, name: str, known: KnownOfFibre, like: str | None, model: str | None, overwrite: bool
) -> tuple[str, ...]:
    """Write a fibre file that loads, settles and steps, or nothing.

    Args:
        path: of the file.
        name: of the fibre.
        like: published fibre to start from; None for `middle_fibre`.
        model: parameter set that the file picks; None for that of the published file.
        overwrite: replace a file that is there.

    Returns:
        where the values come from, and what was not known, one line each.

    Raises:
        UserError: a name or a value that is not allowed, an unknown fibre or model, or a file that is there.
    """
    _check(name, known)
    refuse_older([path] if path.exists() else [], overwrite)
    start = load_fibre(find_fibre_file(like or middle_fibre(model)), model)
    file = start.path
    assert file is not None  # it was read from one
    loaded = {each: load_fibre(file, each) for each in start.available_models}
    factor = _factor(known)
    sets = {each: _scaled(fibre.values, factor, each) for each, fibre in loaded.items()}
    sources = {each: _source(fibre.source, start.name, factor, known) for each, fibre in loaded.items()}
    lines = tuple(_told(start.name, like, known))
    made = replace(
        start, name=name, source=sources.get(start.model) or next(iter(sources.values())),
        reference_length_m=known.reference_length_m or 1.0, f0_n=known.f0_n or 1.0,
    )  # fmt: skip
    head = [f"Fibre {name}, to start from. Units, meaning and range of every parameter: xb_muscle parameters.", *lines]
    text = _commented(fibre_text(made, sets, sources, head), known, loaded, factor)
    with replaced(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
        _try(load_fibre(temporary), path)
    return lines


def _check(name: str, known: KnownOfFibre) -> None:
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise UserError(f"the fibre's name is '{name}'; allowed are letters, digits, _, - and .; give another")
    if any((folder / f"{name}.yaml").is_file() for folder in fibre_folders()):
        raise UserError(f"'{name}' is the name of a fibre of the package; give another name")
    temperature, (low, high) = known.temperature_c, TEMPERATURES_C
    if temperature is not None and not low <= temperature <= high:
        raise UserError(f"--temperature is {temperature:g} °C; allowed is {low:g} to {high:g} °C")
    if known.q10 is not None and temperature is None:
        raise UserError("--q10 scales rates to a temperature; give --temperature as well")
    if known.q10 is not None:
        checked("q10", known.q10, {"q10": Q10}, "--q10")


def _factor(known: KnownOfFibre) -> float:
    """Factor of all rates."""
    if known.q10 is None or known.temperature_c is None:
        return 1.0
    return float(known.q10 ** ((known.temperature_c - TEMPERATURE_C) / 10.0))


def _scaled(values: Mapping[str, float], factor: float, model: str) -> Mapping[str, float]:
    scaled = {key: value * factor if key in RATES else value for key, value in values.items()}
    return MappingProxyType(
        {key: checked(key, value, PARAMETERS, f"--q10, model {model}") for key, value in scaled.items()}
    )


def _source(source: str, start: str, factor: float, known: KnownOfFibre) -> str:
    scaled = "" if factor == 1.0 else f"; rates times {factor:.6g} for {known.temperature_c:g} °C by Q10 {known.q10:g}"
    return f"as fibre {start}: {source}{scaled}"


def _told(start: str, like: str | None, known: KnownOfFibre) -> Sequence[str]:
    """Where values come from, and what is not known."""
    why = "as asked for" if like else "whose parameters are nearest to the median of the package's fibres"
    told = [f"Parameters are those of fibre {start} ({SPECIES} {MUSCLE}, permeabilised, {TEMPERATURE_C:g} °C), {why}."]
    for what, given, published in (("species", known.species, SPECIES), ("muscle", known.muscle, MUSCLE)):
        if given is None:
            told.append(f"The {what} is not given; the parameters are of {SPECIES} {MUSCLE}.")
        elif given.strip().casefold() != published:
            told.append(
                f"No published set of the package fits {what} {' '.join(given.split())}; "
                f"those of {SPECIES} {MUSCLE} stand for it."
            )
    temperature = known.temperature_c
    if temperature is None:
        told.append(f"The temperature is not given; rates are those at {TEMPERATURE_C:g} °C.")
    elif known.q10 is not None:
        told.append(
            f"Rates ({', '.join(RATES)}) are times {_factor(known):.6g}: "
            f"from {TEMPERATURE_C:g} to {temperature:g} °C by the Q10 {known.q10:g} that was given; "
            "all other values are not scaled."
        )
    elif temperature != TEMPERATURE_C:
        told.append(
            f"Rates are those at {TEMPERATURE_C:g} °C, not at {temperature:g} °C: no Q10 was given. "
            "--q10 scales all rates by one."
        )
    if known.f0_n is None:
        told.append(
            "F0 is not given" + (", and an area alone does not tell it" if known.area_m2 else "") + "; it is 1 N."
        )
    elif known.area_m2 is not None:
        stress = known.f0_n / known.area_m2
        usual = "" if STRESS_PA[0] <= stress <= STRESS_PA[1] else (
            f"; muscle has {STRESS_PA[0] / 1e3:g} to {STRESS_PA[1] / 1e3:g} kPa: check both"
        )  # fmt: skip
        told.append(f"F0 is {stress / 1e3:.4g} kPa on an area of {known.area_m2:.6g} m^2{usual}.")
    if known.reference_length_m is None:
        told.append("L0 is not given; it is 1 m, as for normalised lengths.")
    told.append("These are values to start from; xb_muscle fit finds the fibre's own.")
    return told


def _commented(text: str, known: KnownOfFibre, loaded: Mapping[str, Fibre], factor: float) -> str:
    """Comments behind constants and scaled rates."""
    lines, current = [], ""
    for line in text.splitlines():
        key, _, value = line.strip().partition(": ")
        if key.rstrip(":") in loaded and not value:
            current = key.rstrip(":")
        if key == "reference_length_m":
            line += "  # L0, m; " + ("not given" if known.reference_length_m is None else "as given")
        elif key == "f0_n":
            line += "  # F0, N; " + ("not given" if known.f0_n is None else "as given")
        elif factor != 1.0 and current and key in RATES and not line.startswith("#"):
            line += f"  # {loaded[current].values[key]:.6g} at {TEMPERATURE_C:g} °C"
        lines.append(line)
    return "\n".join(lines) + "\n"


def _try(fibre: Fibre, path: Path) -> None:
    """Make sure that a fibre settles, relaxed and active, and steps.

    Raises:
        UserError: it does not.
    """
    muscle = Muscle(fibre)
    forces = []
    for pca in (_RELAXED_PCA, _ACTIVE_PCA):
        calcium_um = 10.0 ** (6.0 - pca)
        state = muscle.settle(0.0, calcium_um)
        for i in range(10):
            state = muscle.step(state, 5e-4 * i, calcium_um, 1e-3)
        forces.append(muscle.outputs(state).force_f0)
    if not 0.0 <= forces[0] < forces[1]:
        raise UserError(
            f"{path}: force is {forces[0]:.4g} F0 at pCa {_RELAXED_PCA:g}, {forces[1]:.4g} F0 at pCa {_ACTIVE_PCA:g}; "
            "needed is more when active; start from another fibre with --like"
        )


def known_like(name: str) -> str:
    """Whether a fibre is one of the package: its name, else refused with the nearest."""
    names = {file.stem for folder in fibre_folders() for file in folder.glob("*.yaml")}
    if name not in names:
        raise UserError(f"--like is '{name}', no fibre of the package{suggest(name, names)}")
    return name
