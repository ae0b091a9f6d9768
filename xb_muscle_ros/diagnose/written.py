"""What a diagnosis wrote into its folder, read back with every gap filled by None or an empty list."""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError

Array = npt.NDArray[np.float64]

_LISTS: Mapping[str, tuple[str, ...]] = {
    "trials": (
        "trial", "pca", "phases", "noise_sd_f0", "noise_from", "noise_samples", "before_rmsd_f0", "after_rmsd_f0",
        "heldout_before_f0", "heldout_after_f0",
    ),
    "mismatch": ("trial", "phase", "start_s", "end_s", "size_f0", "mean_f0", "sign", "p_value"),
    "conflicts": ("between", "parts", "gone", "furthest"),
    "nuisances": ("name", "group", "value", "sd", "prior_sd", "unit"),
    "base_parameters": ("name", "start", "fitted", "unit"),
    "candidates": (
        "name", "kind", "family", "parameters", "interval", "train_rmsd_f0", "heldout_rmsd_f0", "delta_elpd", "se",
        "note",
    ),
    "checks": ("name", "passed", "value"),
}  # fmt: skip
_PLAIN_LISTS = ("answer", "missing", "warnings", "notes")
_GROUPS: Mapping[str, tuple[str, ...]] = {
    "before": ("train_rmsd_f0", "heldout_rmsd_f0"),
    "after": ("train_rmsd_f0", "heldout_rmsd_f0"),
    "start": ("train_rmsd_f0",),
    "how": (),
}
_OPTIONAL_GROUPS: Mapping[str, tuple[str, ...]] = {
    "map": ("trials", "phases", "rms_f0", "mean_f0", "p_value", "counts"),
    "map_after": ("trials", "phases", "rms_f0", "mean_f0", "p_value", "counts"),
    "kernel": ("time_constant_s", "scales_with", "gain", "explained", "tau_s", "weight_f0"),
    "profile": ("parameter", "unit", "points", "interval"),
    "heldout_gain": (
        "explanation", "before_f0", "after_f0", "usual_before_f0", "usual_after_f0", "trials", "delta_elpd", "se",
        "of_faults", "gained_f0", "floor_f0", "better",
    ),
    "linear_heldout": ("before_rmsd_f0", "after_rmsd_f0"),
    "next_experiment": ("bag", "protocol", "separates", "expected_difference_f0"),
}  # fmt: skip
_SINGLE = (
    "version", "fibre", "model", "method", "quick", "seed", "seconds", "summary", "verdict", "family", "p_value",
    "confidence", "flexible_bound_rmsd_f0", "augmented_fiber", "described",
)  # fmt: skip


class Trace(NamedTuple):
    """One trial sample by sample, each of shape (n,); None where it was not written.

    Attributes:
        time_s: of the measured samples, s.
        length_l0: length change, L0.
        measured_f0: measured force, F0.
        before_f0: of the base model with its parameters and corrections fitted, F0.
        after_f0: of the augmented model, F0.
    """

    time_s: Array
    length_l0: Array | None
    measured_f0: Array | None
    before_f0: Array | None
    after_f0: Array | None


class Written(NamedTuple):
    """A diagnosis as its folder holds it.

    Attributes:
        facts: ``diagnosis.json``, see `filled`.
        traces: of ``traces.npz``, in the order of ``facts["trials"]``.
    """

    facts: Mapping[str, Any]
    traces: tuple[Trace, ...]


def filled(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """A diagnosis in which every key exists: None for what is unknown (NaN as well), empty lists for none."""
    tree: dict[str, Any] = _finite(dict(diagnosis))
    for name in _SINGLE:
        tree.setdefault(name, None)
    for name in _PLAIN_LISTS:
        tree[name] = list(tree.get(name) or ())
    for name, keys in _LISTS.items():
        tree[name] = [_with(row, keys) for row in tree.get(name) or ()]
    for name, keys in _GROUPS.items():
        tree[name] = _with(tree.get(name) or {}, keys)
    for name, keys in _OPTIONAL_GROUPS.items():
        tree[name] = _with(tree[name], keys) if tree.get(name) else None
    for row in tree["trials"]:
        row["phases"] = [_with(phase, ("name", "start_s", "end_s")) for phase in row["phases"] or ()]
    for row in tree["candidates"]:
        row["parameters"], row["interval"] = row["parameters"] or {}, row["interval"] or {}
    return tree


def read_written(folder: Path) -> Written:
    """Read ``diagnosis.json`` and ``traces.npz``.

    Raises:
        UserError: a file is missing or damaged, or the two do not belong together.
    """
    path = folder / "diagnosis.json"
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}; give a folder that xb_muscle diagnose wrote") from error
    if not isinstance(tree, dict):
        raise UserError(f"{path} holds a {type(tree).__name__}; give a folder that xb_muscle diagnose wrote")
    facts = filled(tree)
    return Written(facts, tuple(_traces(folder / "traces.npz", len(facts["trials"]))))


def _traces(path: Path, count: int) -> list[Trace]:
    try:
        with np.load(path) as arrays:
            return [_trace(arrays, i, path) for i in range(count)]
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise UserError(f"{path} cannot be read: {error}; run xb_muscle diagnose again") from error


def _trace(arrays: Mapping[str, Any], i: int, path: Path) -> Trace:
    if f"t{i}_time_s" not in arrays:
        raise UserError(f"{path} has no t{i}_time_s, but diagnosis.json has trial {i}; run xb_muscle diagnose again")
    time = np.asarray(arrays[f"t{i}_time_s"], dtype=np.float64)

    def signal(name: str) -> Array | None:
        key = f"t{i}_{name}"
        if key not in arrays:
            return None
        values = np.asarray(arrays[key], dtype=np.float64)
        if values.shape != time.shape:
            raise UserError(
                f"{path}: {key} has shape {values.shape}, its time {time.shape}; run xb_muscle diagnose again"
            )
        return values if np.any(np.isfinite(values)) else None

    return Trace(time, *(signal(name) for name in ("length_l0", "measured_f0", "before_f0", "after_f0")))


def _with(row: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    return {**dict.fromkeys(keys), **row}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
