"""Fit the sets that nobody released, 2state_coop and hill, to measured SRS and isometric force, for fibre files.

Usage: fit_missing_sets.py EMPIRICAL_SRS_JSON FIBRE_FOLDER [FIBRE ...]

A set that a file already has is fitted again. Fibres without a file get one, with these sets alone.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import yaml

from xb_muscle_ros.files import write_text
from xb_muscle_ros.fit.coordinates import FITTED, Choice, parameter_coordinates
from xb_muscle_ros.fit.features import KINDS, measured
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import compose
from xb_muscle_ros.work import Options

# Model -> the released set that its start is taken from.
STARTS = {"2state_coop": "3state_coop", "hill": "hill_se"}
PASSIVE_PCA = 9.0
HEAD = """# Fibre {fibre}: permeabilised rat soleus, 22 °C (Horslen et al. 2023). Nobody released its parameters.
# A ROS parameter file; offline tools read it as well. Units, meaning, ranges: xb_muscle parameters.
"""


def start_of(name: str, model: str, folder: Path) -> Fibre:
    """The fibre's released set as far as the model has use for it; other fibres' geometric means where it has none."""
    files = sorted(folder.glob("*.yaml"))
    released = [f for f in files if STARTS[model] in yaml.safe_load(f.read_text())["/**"]["ros__parameters"]["models"]]
    own = [f for f in released if f.stem == name]
    sets = [load_fibre(f, STARTS[model]) for f in own or released]
    needed = [row.name for row in compose(model).parameters if row.name in sets[0].values]
    values = {}
    for parameter in needed:
        given = np.array([s.values[parameter] for s in sets])
        values[parameter] = float(np.exp(np.mean(np.log(given)))) if np.all(given > 0.0) else float(np.mean(given))
    # New fits have no use for the smoothing of the released sets.
    full = complete({**values, "smoothing": 0.0}, model, name)
    return replace(sets[0], name=name, model=model, values=MappingProxyType(full), path=None, available_models=(model,))


def fitted_set(table: Path, fibre: Fibre) -> tuple[dict[str, float], str]:
    """Values of the best point and a line on how they were obtained."""
    features = measured(table, fibre.name)
    if fibre.model == "hill":
        # Without series element force jumps at the onset and hardly rises from there: SRS would only spoil the rest.
        features = tuple(f for f in features if f.kind == "isometric_force" or f.pca == PASSIVE_PCA)
    free = [n for n in FITTED if n in fibre.values and not (fibre.model == "hill" and n == "vmax")]
    choices = {"Fpe0": Choice(lower=0.0, upper=0.2)}
    problem = Problem(fibre, (), parameter_coordinates(fibre, free, (), {}, choices), {}, features)
    found = fit(problem, Settings(starts=4, level=None), Options())
    training = Training(problem)
    distance = training.feature_distance(found.best.z) * [f.sd for f in features]
    kinds = np.array([f.kind for f in features])
    rms = {k: float(np.sqrt(np.mean(distance[kinds == k] ** 2))) for k in KINDS if k in kinds}
    source = (
        f"fitted by this package to {len(features)} measured SRS and isometric forces of this fibre (github "
        "timvanderzee/biophysical-muscle-model, data of Horslen et al. 2023); not released by the paper's authors; "
        f"RMS error {100.0 * rms['isometric_force']:.1f} % F0, {rms['srs_test']:.2f} F0/L0"
    )
    if fibre.model == "hill":
        source += " (passive SRS alone); vmax is that of hill_se"
    return dict(problem.fibre_at(found.best.z).values), source


def add(path: Path, name: str, sets: dict[str, dict[str, float]], sources: dict[str, str]) -> None:
    """Write a fibre file that has these sets beside what it had."""
    tree = yaml.safe_load(path.read_text(encoding="utf-8")) if path.is_file() else {"/**": {"ros__parameters": {}}}
    inner = tree["/**"]["ros__parameters"]
    text = path.read_text(encoding="utf-8") if path.is_file() else HEAD.format(fibre=name)
    head = "".join(f"{line}\n" for line in text.splitlines() if line.startswith("#"))
    made = {
        "fibre": name,
        "model": inner.get("model", next(iter(sets))),
        "method": inner.get("method", "gaussian"),
        "source": inner.get("source", "see 'sources' of each set"),
        "sources": {**inner.get("sources", {}), **sources},
        "constants": inner.get("constants", {"reference_length_m": 1.0, "f0_n": 1.0}),
        "models": {**inner.get("models", {}), **sets},
    }
    body = yaml.safe_dump({"/**": {"ros__parameters": made}}, sort_keys=False, allow_unicode=True, width=10**6)
    write_text(path, head + body)
    for model in made["models"]:
        load_fibre(path, model)


def main(table: Path, folder: Path, names: list[str]) -> None:
    """Fit and write fibre by fibre."""
    for name in names or list(json.loads(table.read_text(encoding="utf-8"))["fibres"]):
        sets, sources = {}, {}
        for model in STARTS:
            values, sources[model] = fitted_set(table, start_of(name, model, folder))
            sets[model] = {n: float(f"{v:.6g}") for n, v in values.items()}
            print(f"{name} {model}: {sources[model]}", flush=True)
        add(folder / f"{name}.yaml", name, sets, sources)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
