"""The page of the recordings: one section to a case, made of what its folder holds; nothing is written by hand."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

# What is averaged at the end of a trial, s.
_END_S = 0.5
_CANDIDATES, _PLACES = 8, 6

INTRO = """# Real recordings

Made by `scripts/diagnose_recordings.py`: trials are imported, a base model is fitted to some of them, these are
diagnosed, and the others, concealed until then, are predicted. Of a concealed trial nothing is used but its own
force before anything moves, and that only for faults of the measurement. Differences are root mean squares in % F0.
"""


def write_page(cases: Sequence[tuple[str, str, Path]], images: str) -> str:
    """The page.

    Args:
        cases: key, what to say first, and folder of each case that is done.
        images: folder of the figures, as the page links it.
    """
    return "\n".join([INTRO, *(section(key, about, folder, images) for key, about, folder in cases)])


def section(key: str, about: str, folder: Path, images: str) -> str:
    """One case."""
    facts = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    found = json.loads((folder / "predictions.json").read_text(encoding="utf-8"))
    with np.load(folder / "predictions.npz") as arrays:
        ends = [_ends(arrays, f"p{k}") for k in range(len(found["concealed"]))]
    parts = [
        about,
        f"![{about.splitlines()[0].lstrip('# ')}]({images}/recorded_{key}.png)",
        facts["summary"],
        _verdict(facts, found),
        "Where the base differs most:\n\n" + places(facts["mismatch"]),
        "What was tried:\n\n" + candidates(facts["candidates"]),
        "Concealed trials (–: no solution at these parameters, heads are stretched past where the form of their "
        "distribution holds):\n\n" + concealed(found, ends),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _verdict(facts: Mapping[str, Any], found: Mapping[str, Any]) -> str:
    answer = f": {', '.join(facts['answer'])}" if facts["answer"] else ""
    effort = "quick" if facts["quick"] else "full"
    lines = [
        f"Verdict (`{facts['model']}`, {len(facts['trials'])} trials, {effort} search): "
        f"**{facts['verdict']}{answer}**, confidence {facts['confidence']:.2f}. "
        f"Best explanation found: {found['best_found']}."
    ]
    lines += [f"- {'passed' if c['passed'] else 'failed'}: {c['name']} ({c['value']})" for c in facts["checks"]]
    lines += [f"- missing: {line}" for line in facts["missing"]]
    return "\n".join(lines)


def places(mismatch: Sequence[Mapping[str, Any]]) -> str:
    """The largest cells of a mismatch as Markdown."""
    if not mismatch:
        return "nowhere by more than noise."
    rows = [
        [m["trial"], m["phase"], f"{m['start_s']:.2f}–{m['end_s']:.2f}", _percent(m["size_f0"]), _percent(m["mean_f0"])]
        for m in mismatch[:_PLACES]
    ]
    return _table(["trial", "phase", "time (s)", "size", "mean, measured less model"], rows)


def candidates(rows: Sequence[Mapping[str, Any]]) -> str:
    """The base and the best explanations as Markdown."""
    fitted = [r for r in rows if r["train_rmsd_f0"] is not None]
    chosen = [r for r in fitted if r["kind"] == "base"] + [r for r in fitted if r["kind"] != "base"][:_CANDIDATES]
    cells = [[r["name"], _percent(r["train_rmsd_f0"]), _percent(r["heldout_rmsd_f0"])] for r in chosen]
    return _table(["explanation", "shown trials", "the same, each left out of the fit"], cells)


def concealed(found: Mapping[str, Any], ends: Sequence[tuple[float, float, float]]) -> str:
    """How concealed trials are predicted, as Markdown."""
    rows = found["concealed"]
    if not rows:
        return "none."
    labels = list(rows[0]["rmsd_f0"])
    cells = [
        [row["tests"], row["trial"], *(_percent(row["rmsd_f0"][n]) for n in labels), " / ".join(map(_percent, end))]
        for row, end in zip(rows, ends, strict=True)
    ]
    total = [_percent(_overall([row["rmsd_f0"][n] for row in rows])) for n in labels]
    return _table(
        ["tests", "trial", *labels, f"last {_END_S:g} s: measured / base / best"], [*cells, ["all", "", *total, ""]]
    )


def _overall(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if len(known) == len(values) else None


def _ends(arrays: Mapping[str, Any], key: str) -> tuple[float, float, float]:
    """Mean forces at the end of a trial: measured, base, best explanation."""
    time = arrays[f"{key}_time_s"]
    late = time >= time[-1] - _END_S
    measured, before, after = (float(np.mean(arrays[f"{key}_{n}_f0"][late])) for n in ("measured", "before", "after"))
    return measured, before, after


def _percent(value: float | None) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{100.0 * value:.2f}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
