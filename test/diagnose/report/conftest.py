"""Made diagnoses: a study simulated by the model, and what the tool would write of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.report import write_report
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.diagnose.words import is_fault
from xb_muscle_ros.replay.made import NOISE_SD_F0

sys.path.insert(0, str(Path(__file__).parent))

from made_study import Array, Study, rms

EFFECTS = {"physics": "drag", "ambiguous": "drag", "measurement": "gain", "unexplained": "other"}
ANSWERS: dict[str, tuple[str, ...]] = {
    "physics": ("viscous_drag",),
    "ambiguous": ("viscous_drag", "passive_viscoelasticity"),
    "measurement": ("length_gain",),
}
# Fewer independent observations than samples: noise remembers about 20 samples.
MEMORY = 20.0


def overall(parts: list[Array]) -> float:
    """RMS over all samples of all trials."""
    return rms(np.concatenate(parts))


def table_of(study: Study, left: list[Array]) -> dict[str, Any]:
    """Map of what is left over trials and phases; a cell counts where it is beyond three times its error."""
    names = list(dict.fromkeys(p.name for t in study.trials for p in t.facts.phases))
    cells: dict[str, list[list[float | None]]] = {"rms_f0": [], "mean_f0": [], "p_value": []}
    for trial, rest in zip(study.trials, left, strict=True):
        phases = trial.phases_by_name()
        for rows in cells.values():
            rows.append([None] * len(names))
        for j, name in enumerate(names):
            if name not in phases:
                continue
            part = rest[(trial.time_s >= phases[name].start_s) & (trial.time_s < phases[name].end_s)]
            cells["rms_f0"][-1][j], cells["mean_f0"][-1][j] = rms(part), float(part.mean())
            beyond = rms(part) ** 2 - NOISE_SD_F0**2 > 3.0 * NOISE_SD_F0**2 * np.sqrt(2.0 * MEMORY / part.size)
            cells["p_value"][-1][j] = 0.002 if beyond else 0.4
    return {"trials": [t.facts.trial for t in study.trials], "phases": names, **cells}


def candidate_rows(study: Study) -> list[dict[str, Any]]:
    """Every signal, best first, the base among them, and some that were screened."""
    scale = 2.0 * MEMORY * NOISE_SD_F0**2
    base = np.array([float(r @ r) for r in study.left])
    rows: list[dict[str, Any]] = [{
        "name": "base", "kind": "base", "family": None, "parameters": {}, "interval": {}, "delta_elpd": 0.0, "se": 0.0,
        "train_rmsd_f0": overall(study.left), "heldout_rmsd_f0": overall(study.left), "note": "",
    }]  # fmt: skip
    for name, signal in study.signals.items():
        value, inside, outside = study.explained(name)
        error = NOISE_SD_F0 * np.sqrt(MEMORY / sum(float(s @ s) for s in signal))
        gains = (base - [float(np.sum((r - o) ** 2)) for r, o in zip(study.left, outside, strict=True)]) / scale
        key = {"viscous_drag": "drag", "passive_viscoelasticity": "kpe", "static_calcium_stiffness": "kca"}.get(
            name, name
        )
        rows.append({
            "name": name, "kind": "measurement" if is_fault(name) else "mechanism", "family": FAMILY[Name(name)],
            "parameters": {key: value}, "interval": {key: [value - 1.96 * error, value + 1.96 * error]},
            "train_rmsd_f0": rms(np.concatenate([r - i for r, i in zip(study.left, inside, strict=True)])),
            "heldout_rmsd_f0": rms(np.concatenate([r - o for r, o in zip(study.left, outside, strict=True)])),
            "delta_elpd": float(gains.sum()), "se": float(np.sqrt(gains.size) * gains.std()), "note": "",
        })  # fmt: skip
    rows.sort(key=lambda row: -row["delta_elpd"])
    for name in ("phosphate", "temperature", "half_sarcomere_spread", "series_compliance", "lattice_spacing"):
        rows.append({
            "name": name, "kind": "mechanism", "family": FAMILY[Name(name)], "parameters": {}, "interval": {},
            "train_rmsd_f0": None, "heldout_rmsd_f0": None, "delta_elpd": None, "se": None,
            "note": "screened: explains 3 % of what is left",
        })  # fmt: skip
    return rows


def mismatches(study: Study, shown: dict[str, Any]) -> list[dict[str, Any]]:
    """Cells of a map that count, largest first."""
    found = []
    for i, trial in enumerate(study.trials):
        for phase in trial.facts.phases:
            j = shown["phases"].index(phase.name)
            mean = shown["mean_f0"][i][j]
            if shown["p_value"][i][j] < 0.05:
                found.append({
                    "trial": trial.facts.trial, "phase": phase.name, "start_s": phase.start_s, "end_s": phase.end_s,
                    "size_f0": shown["rms_f0"][i][j], "mean_f0": mean, "sign": 1 if mean > 0 else -1, "p_value": 0.002,
                })  # fmt: skip
    return sorted(found, key=lambda row: -row["size_f0"])


def profile_of(row: dict[str, Any]) -> dict[str, Any]:
    """Of a candidate's only parameter: straight sides, as it enters the force in proportion."""
    ((key, value),) = row["parameters"].items()
    low, high = row["interval"][key]
    sd = (high - low) / 3.92
    points = [[value + k * sd, abs(k)] for k in np.linspace(-3, 3, 13).tolist()]
    return {"parameter": key, "unit": "s" if key == "drag" else "1", "points": points, "interval": [low, high]}


def words_of(verdict: str, quiet: bool, answered: bool) -> dict[str, Any]:
    """What a diagnosis says beside its numbers."""
    sure, physics = "0.41" if quiet else "0.003", verdict == "physics"
    return {
        "checks": [
            {"name": "what is left is beyond chance: p < 0.01", "passed": not quiet, "value": sure},
            {"name": "faults of the measurement do worse by 2 s.e. and more", "passed": physics, "value": "3.1"},
            {"name": "the interval of the parameter leaves out zero", "passed": answered, "value": ""},
            {"name": "places located are clean afterwards", "passed": physics, "value": "0 of 9"},
            {"name": "gains half of what a flexible curve does", "passed": None if quiet else answered, "value": None},
        ],
        "next_experiment": None if quiet else {
            "bag": "next_experiment",
            "protocol": "Stretch by 4 % L0 at 0.05, 0.2, 1 and 2 L0/s at pCa 9 and 4.5, with a hold of 1 s.",
            "separates": list(ANSWERS["ambiguous"]), "expected_difference_f0": 0.012,
        },
        "augmented_fiber": "augmented.yaml" if answered else None,
        "missing": ["a trial without any stretch, to tell drift from slow elasticity", "a second speed of stretch"],
        "warnings": [] if quiet else ["parameter k12 ended at its upper bound"],
        "how": {
            "rmsd": "Root of the mean square of measured minus modelled force at 1 kHz, trials weighted alike.",
            "p_value": "Share of 199 simulated repeats, each fitted anew, that leave at least as much.",
            "something_else": "An entry that no number on the page links to.",
        },
    }  # fmt: skip


def diagnosis_of(study: Study, verdict: str) -> dict[str, Any]:
    """What the tool would write: errors, map, memory and candidates come from the traces, the rest is made up."""
    answer = ANSWERS.get(verdict, ())
    rows = candidate_rows(study)
    nothing = [np.zeros_like(r) for r in study.left]
    _, inside, outside = study.explained(answer[0]) if answer else (0.0, nothing, nothing)
    after = [r - i for r, i in zip(study.left, inside, strict=True)]
    heldout = [r - o for r, o in zip(study.left, outside, strict=True)]
    start = [m - s for m, s in zip(study.measured, study.start, strict=True)]
    shown = table_of(study, study.left)
    best = next((row for row in rows if answer and row["name"] == answer[0]), None)
    quiet = verdict in ("none", "parameters")
    facts: dict[str, Any] = {
        "version": 1, "fibre": "18Dec2017a", "model": "3state_coop", "method": "gaussian", "quick": False, "seed": 1,
        "seconds": 81.2, "verdict": verdict, "answer": list(answer),
        "family": best["family"] if best else None, "p_value": 0.41 if quiet else 0.003,
        "confidence": {"ambiguous": 0.55, "unexplained": 0.2, "none": 0.9}.get(verdict, 0.94),
        "trials": [
            {
                "trial": trial.facts.trial, "pca": trial.facts.pca, "noise_sd_f0": NOISE_SD_F0, "noise_from": "curve",
                "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in trial.facts.phases],
                "before_rmsd_f0": rms(study.left[i]), "after_rmsd_f0": rms(after[i]),
                "heldout_before_f0": rms(study.left[i]), "heldout_after_f0": rms(heldout[i]),
            }
            for i, trial in enumerate(study.trials)
        ],
        "conflicts": [
            {"between": "solutions", "parts": 2, "gone": 0.97, "furthest": 1.2},
            {"between": "trials", "parts": len(study.trials), "gone": 0.98, "furthest": 1.1},
        ],
        "mismatch": mismatches(study, shown), "map": shown, "map_after": table_of(study, after),
        "kernel": None if quiet else study.kernel(),
        "nuisances": [
            {"name": "pca_shift", "group": f"pCa {pca:g}", "value": 0.01, "sd": 0.008, "prior_sd": 0.05, "unit": "1"}
            for pca in sorted({t.facts.pca for t in study.trials})
        ],
        "base_parameters": [
            {"name": "f", "start": 95.0, "fitted": 80.2, "unit": "1/s"},
            {"name": "k21", "start": 19.0, "fitted": 22.4, "unit": "1/s"},
            {"name": "kse", "start": 0.33, "fitted": 0.331, "unit": "F0/L0"},
        ],
        "candidates": rows, "profile": profile_of(best) if best else None,
        "before": {"train_rmsd_f0": overall(study.left), "heldout_rmsd_f0": overall(study.left)},
        "after": {"train_rmsd_f0": overall(after), "heldout_rmsd_f0": overall(heldout)},
        "start": {"train_rmsd_f0": overall(start)},
        "flexible_bound_rmsd_f0": study.flexible(),
        "linear_heldout": {"before_rmsd_f0": overall(study.left), "after_rmsd_f0": overall(heldout)},
        **words_of(verdict, quiet, bool(answer)),
    }  # fmt: skip
    facts["summary"] = summary_text(facts)
    return facts


def save(folder: Path, study: Study, facts: dict[str, Any]) -> Path:
    """Both files as the tool writes them."""
    folder.mkdir(parents=True, exist_ok=True)
    answer = facts["answer"]
    inside = study.explained(answer[0])[1] if answer and answer[0] in study.signals else [0.0] * len(study.left)
    arrays = {}
    for i, trial in enumerate(study.trials):
        arrays |= {
            f"t{i}_time_s": trial.time_s,
            f"t{i}_length_l0": trial.length_change_l0,
            f"t{i}_measured_f0": study.measured[i],
            f"t{i}_start_f0": study.start[i],
            f"t{i}_before_f0": study.before[i],
            f"t{i}_after_f0": study.before[i] + inside[i],
        }
    np.savez(folder / "traces.npz", **arrays)
    (folder / "diagnosis.json").write_text(json.dumps(facts), encoding="utf-8")
    return folder


@cache
def study_of(verdict: str, pcas: tuple[float, ...] = (6.4, 4.5)) -> Study:
    return Study(pcas, EFFECTS.get(verdict, "nothing"))


class Made(NamedTuple):
    """A diagnosis and its folder.

    Attributes:
        folder: with `diagnosis.json`, as it was first, and `traces.npz`.
        facts: that a test may change.
        study: that it is of.
    """

    folder: Path
    facts: dict[str, Any]
    study: Study

    def report(self) -> Path:
        """Write the facts as they are now, and the page."""
        return write_report(save(self.folder, self.study, self.facts))


@pytest.fixture
def made(tmp_path: Path) -> Callable[..., Made]:
    """Makes a diagnosis by its verdict and, if need be, pCas of its trials."""

    def make(verdict: str, *pcas: tuple[float, ...]) -> Made:
        study = study_of(verdict, *pcas)
        found = Made(tmp_path, diagnosis_of(study, verdict), study)
        save(tmp_path, study, found.facts)
        return found

    return make
