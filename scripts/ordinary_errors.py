"""How large ordinary errors of the measurement are in real sets, as far as the sets tell: what the priors rest on.

Without a model: pCa shifts from isometric force of rat soleus fibres (a Hill curve for each), force offsets from
resting force of whole muscles at one length. With one: fits of a model to bags, all ordinary errors beside its
parameters, with priors three times as wide as the defaults.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.trials.bags import find_bags, read_trial
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

WIDER = 3.0
# Length (L0), resting force and initial time (s) that belong together; a Hill curve's own error, F0.
SAME_L0, REST_S, FORCE_SD_F0 = 0.01, 0.05, 0.01
# Below this slope of the force-pCa curve (F0 per pCa) a shift shows in nothing.
STEEP = 0.3


def hill_shifts(table: Path) -> None:
    """Shift of each solution from a fibre's own Hill curve, and their SD over all fibres."""
    rows = json.loads(table.read_text())
    squares, freedom = 0.0, 0
    for name, cells in rows["fibres"].items():
        force = [np.array(cells["isometric_force"][i], dtype=float) for i in range(len(rows["pCa"]))]
        known = [(p, float(np.nanmean(f))) for p, f in zip(rows["pCa"], force, strict=True) if np.isfinite(f).any()]
        pca, mean = np.array(known).T
        if pca.size < 5 or pca[0] > 5.0:
            continue

        def parts(z: np.ndarray, pca: np.ndarray = pca) -> tuple[np.ndarray, np.ndarray]:
            share = 1.0 / (1.0 + 10.0 ** (z[1] * (pca - z[0])))
            return z[3] + (z[2] - z[3]) * share, (z[2] - z[3]) * z[1] * np.log(10.0) * share * (1.0 - share)

        def left(z: np.ndarray, pca: np.ndarray = pca, mean: np.ndarray = mean) -> np.ndarray:
            force, slope = parts(z, pca)
            distance: np.ndarray = (mean - force) / np.hypot(FORCE_SD_F0, ARTEFACTS["pca_shift"].sd * slope)
            return distance

        found = least_squares(left, [6.2, 3.0, 1.0, 0.01]).x
        force, slope = parts(found)
        shifts = {f"{p:g}": (f - m) / s for p, m, f, s in zip(pca, mean, force, slope, strict=True) if s > STEEP}
        squares += sum(shift**2 for shift in shifts.values())
        freedom += pca.size - 4
        print(f"  {name:12s}", ", ".join(f"pCa {p} {shift:+.3f}" for p, shift in shifts.items()))
    print(f"pca_shift: SD {np.sqrt(squares / freedom):.3f} ({freedom} degrees of freedom)")


def resting_forces(trials: list[Trial]) -> None:
    """Spread of the force at the begin of trials that begin at one length."""
    groups: dict[int, list[float]] = defaultdict(list)
    for trial in trials:
        begin = trial.force_time_s < trial.force_time_s[0] + REST_S
        groups[round(float(trial.length_change_l0[0]) / SAME_L0)].append(float(np.mean(trial.measured_f0[begin])))
    for place, forces in sorted(groups.items()):
        if len(forces) > 2:
            spread = 100.0 * np.std(forces, ddof=1)
            print(f"  at {100 * place * SAME_L0:g} % L0: {len(forces)} trials, SD {spread:.2f} % F0")


def fitted(folder: str, fibre: str, model: str) -> None:
    """Estimates of all ordinary errors in a folder of bags, with their standard deviations."""
    trials = [read_trial(bag) for bag in find_bags([folder])]
    start = changed(load_fibre(fibre, model), {"smoothing": 0.0}, "ordinary errors")
    prepared = fit_trials(trials, [False] * len(trials))
    coordinates = parameter_coordinates(start, None, (), {}, {})
    wide = {name: WIDER * ARTEFACTS[name].sd for name in ORDINARY}
    coordinates += fault_coordinates(ORDINARY, [t.name for t in prepared], [t.solution for t in prepared], wide)
    problem = Problem(start, prepared, coordinates, {}, (F0_ANCHOR,))
    found = fit(problem, Settings(starts=2, level=None), Options(processes=0, quiet=True))
    sds = np.sqrt(np.diag(found.shape.covariance))
    print(f"{folder}, {model}: {100.0 * found.best.rmsd_f0:.2f} % F0")
    for c, z, sd in zip(problem.coordinates, found.best.z, sds, strict=True):
        if c.group is not None:
            print(f"  {c.label:50s} {z:+.4g} ± {sd:.2g} {ARTEFACTS[c.name].unit}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--features", type=Path, help="empirical_srs.json")
    parser.add_argument(
        "--rest", nargs="+", default=[], metavar="FOLDER", help="bags of whole muscles that begin at rest"
    )
    parser.add_argument("--fit", nargs="+", default=[], metavar="FIBER=FOLDER", help="bags to fit")
    parser.add_argument("--model", default="3state_coop")
    given = parser.parse_args()
    if given.features:
        hill_shifts(given.features)
    for each in given.rest:
        print(f"force_offset, {each}")
        resting_forces([read_trial(bag) for bag in find_bags([each])])
    for each in given.fit:
        fitted(each.partition("=")[2], each.partition("=")[0], given.model)
