"""A diagnosis as plain data: what `diagnosis.json` holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.crossval import difference
from xb_muscle_ros.diagnose.explained import HOW
from xb_muscle_ros.diagnose.kernel import Law
from xb_muscle_ros.diagnose.mismatch import rmsd, simulated
from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, Name
from xb_muscle_ros.diagnose.outcome import AUGMENTED, NEXT, Outcome
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.search import penalised
from xb_muscle_ros.diagnose.significance import ALPHA
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.measurement.faults import FAULTS
from xb_muscle_ros.models.parameters import PARAMETERS

Array = npt.NDArray[np.float64]


def as_json(o: Outcome, quick: bool) -> dict[str, Any]:
    """The diagnosis as plain data."""
    d, fibre = o.decision, o.study.fibre
    found: dict[str, Any] = {
        "version": 1,
        "fibre": fibre.name,
        "model": fibre.model,
        "method": fibre.method,
        "quick": quick,
        "seed": o.seed,
        "seconds": o.seconds,
        "summary": "",
        "verdict": d.verdict.value,
        "answer": [n.value for n in d.answer],
        "family": d.family,
        "p_value": o.before.overall_p,
        "confidence": d.confidence,
        "described": o.described,
        "trials": _trials(o),
        "mismatch": o.before.mismatch(ALPHA) or _whole_mismatch(o),
        "map": o.before.map(ALPHA),
        "map_after": (o.before if o.shown is o.search.base else o.after).map(ALPHA),
        "conflicts": [c._asdict() for c in o.conflicts],
        "kernel": _kernel(o.law),
        "nuisances": _nuisances(o),
        "base_parameters": [
            {"name": name, "start": fibre.values[name], "fitted": value, "unit": PARAMETERS[name].unit}
            for name, value in o.search.base.values.items()
        ],
        "candidates": _candidates(o),
        "profile": None
        if o.known is None or not o.known.points
        else {
            "parameter": o.known.parameter,
            "unit": PARAMETERS[o.known.parameter].unit,
            "points": [list(p) for p in o.known.points],
            "interval": list(o.known.interval),
        },
        "before": _scores(o, o.search.base),
        "after": _scores(o, o.shown),
        "heldout_gain": None if d.gain is None else d.gain.to_json(o.search.final.explanation.label),
        "start": {"train_rmsd_f0": rmsd([t.measured_f0 for t in o.study.trials], o.start_forces)},
        "flexible_bound_rmsd_f0": o.bound.flexible_f0 if o.bound else None,
        "linear_heldout": {"before_rmsd_f0": o.bound.before_f0, "after_rmsd_f0": o.bound.after_f0} if o.bound else None,
        "checks": [c._asdict() for c in d.checks],
        "next_experiment": None
        if o.proposal is None
        else {
            "bag": NEXT,
            "protocol": o.proposal.protocol.words,
            "separates": list(o.proposal.separates),
            "expected_difference_f0": o.proposal.difference_f0,
        },
        "augmented_fiber": AUGMENTED if o.augmented else None,
        "missing": list(o.missing),
        "warnings": list(o.warnings),
        "notes": list(o.notes),
        "how": dict(HOW),
    }
    found["summary"] = summary_text(found)
    return found


def _whole_mismatch(o: Outcome) -> list[dict[str, Any]]:
    """Where the whole stands out but no cell does: the largest cell, with the p-value of the whole."""
    if not o.before.detected(ALPHA):
        return []
    i = int(np.argmax(o.before.rms_f0))
    cell = o.before.cells[i]
    mean = float(o.before.mean_f0[i])
    return [
        {
            "trial": cell.trial,
            "phase": cell.phase,
            "start_s": cell.start_s,
            "end_s": cell.end_s,
            "size_f0": float(o.before.rms_f0[i]),
            "mean_f0": mean,
            "sign": 1 if mean >= 0.0 else -1,
            "p_value": float(o.before.p_value[i]),
        }
    ]


def _scores(o: Outcome, fit: Fit) -> dict[str, float | None]:
    scores = o.heldout.get(fit.explanation.label)
    return {"train_rmsd_f0": fit.rmsd_f0, "heldout_rmsd_f0": None if scores is None else scores.rmsd_f0}


def _trials(o: Outcome) -> list[dict[str, Any]]:
    base, shown = simulated(o.study, o.search.base), simulated(o.study, o.shown)
    noise = o.recordings.noise.of([t.name for t in o.study.trials]).trials
    rows = []
    for k, (trial, fitted) in enumerate(zip(o.trials, o.study.trials, strict=True)):
        row: dict[str, Any] = {
            "trial": fitted.name,
            "pca": trial.facts.pca,
            "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in trial.facts.phases],
            "noise_sd_f0": noise[k].sd_f0,
            "noise_from": noise[k].source.value,
            "noise_samples": noise[k].samples,
        }
        for key, forces in (("before", base), ("after", shown)):
            row[f"{key}_rmsd_f0"] = float(np.sqrt(np.mean((fitted.measured_f0 - forces[k]) ** 2)))
        for key, fit in (("before", o.search.base), ("after", o.shown)):
            scores = o.heldout.get(fit.explanation.label)
            row[f"heldout_{key}_f0"] = None if scores is None else float(np.sqrt(scores.mse[fitted.name]))
        rows.append(row)
    return rows


def _kernel(law: Law | None) -> dict[str, Any] | None:
    if law is None:
        return None
    return {
        "time_constant_s": law.time_constant_s,
        "scales_with": law.scales_with,
        "gain": law.stiffness_f0_per_l0,
        "explained": law.explained,
        "tau_s": law.tau_s.tolist(),
        "weight_f0": law.weight_f0.tolist(),
        "others": dict(law.others),
    }


def _nuisances(o: Outcome) -> list[dict[str, Any]]:
    problem = o.shown.problem(o.study)
    inverse = np.linalg.pinv(o.last.fit.slopes.T @ (o.last.fit.slopes * o.last.fit.weights[:, None] ** 2))
    known = len(problem.coordinates) == inverse.shape[0]
    rows = []
    for j, c in enumerate(problem.coordinates):
        if c.group is not None:
            sd = float(np.sqrt(max(inverse[j, j], 0.0))) if known else None
            row = {"name": c.name, "group": c.group, "value": c.start, "sd": sd}
            rows.append({**row, "prior_sd": c.prior_sd, "unit": FAULTS[c.name].unit})
    return rows


def _candidates(o: Outcome) -> list[dict[str, Any]]:
    base = o.heldout.get(o.search.base.explanation.label)
    rows = []
    for fit in sorted(o.search.fits.values(), key=penalised):
        label = fit.explanation.label
        scores = o.heldout.get(label)
        apart = difference(scores, base) if scores is not None and base is not None else None
        names = fit.explanation.names
        own = {k: v for k, v in fit.values.items() if k not in o.search.base.values}
        interval = {}
        if o.known is not None and label == o.search.final.explanation.label:
            interval = {o.known.parameter: list(o.known.interval)}
        rows.append(
            {
                "name": label,
                "kind": _kind(names),
                "family": FAMILY[names[0]] if len(names) == 1 else None,
                "parameters": own,
                "interval": interval,
                "train_rmsd_f0": fit.rmsd_f0,
                "heldout_rmsd_f0": None if scores is None else scores.rmsd_f0,
                "delta_elpd": None if apart is None else apart.delta_elpd,
                "se": None if apart is None else apart.se,
                "note": "",
            }
        )
    fitted = {r["name"] for r in rows}
    rows += [
        {
            "name": s.name.value,
            "kind": _kind((s.name,)),
            "family": FAMILY[s.name],
            "parameters": {},
            "interval": {},
            "train_rmsd_f0": None,
            "heldout_rmsd_f0": None,
            "delta_elpd": None,
            "se": None,
            "note": f"not fitted: to first order it takes {_promise(s.gain, o.search.base.cost):.0f} % off the misfit",
        }
        for s in o.search.screened
        if s.name.value not in fitted
    ]
    return rows


def _promise(gain: float, cost: float) -> float:
    return 100.0 * gain / cost if cost > 0.0 else 0.0


def _kind(names: tuple[Name, ...]) -> str:
    if not names:
        return "base"
    if len(names) > 1:
        return "pair"
    return "measurement" if names[0] in MEASUREMENT else "mechanism"
