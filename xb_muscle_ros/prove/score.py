"""A benchmark scored: the key opened, its hash checked, diagnoses counted, tables and figures written."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json, write_text
from xb_muscle_ros.prove import calibration
from xb_muscle_ros.prove.answers import Answer
from xb_muscle_ros.prove.calibration import Stated, as_stated, reliability
from xb_muscle_ros.prove.counting import Score, by_size, of_composites, of_singles
from xb_muscle_ros.prove.judging import JudgedEffect, JudgedSingle, judge, judge_composite
from xb_muscle_ros.prove.run import RESULTS
from xb_muscle_ros.prove.score_figures import draw_composites, draw_singles
from xb_muscle_ros.prove.sealing import COMPOSITES, SINGLES, kind_of, load_benchmark, open_key
from xb_muscle_ros.tables import Columns, filled, markdown, number
from xb_muscle_ros.trials.bag_files import remove_results

# Confidence in a first name is binned in fifths.
_CONFIDENCE_BINS = 5


def score(results: Path, key: Path, out: Path, overwrite: bool = False) -> tuple[str, list[Path]]:
    """Score the results of `prove run`.

    Args:
        results: folder with ``results.json`` and ``benchmark.json``.
        key: its hash must be the one of ``benchmark.json``.
        out: gets ``scores.json``, ``scores.md`` and figures.

    Returns:
        The table in words, and the files.

    Raises:
        UserError: a file is missing or is not what it should be, or the key is another one.
    """
    refuse_older(_older(out), overwrite)
    benchmark = load_benchmark(results)
    truths = open_key(key, benchmark)["cases"]
    path = results / RESULTS
    try:
        cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
        found = {name: Answer.read(row) for name, row in cases.items()}
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{path} cannot be read; give the folder that 'prove run' wrote") from error
    missing = [truth["case"] for truth in truths if truth["case"] not in found]
    if missing:
        raise UserError(f"{path} lacks {len(missing)} of {len(truths)} cases, {missing[0]} first; finish 'prove run'")
    return _write(_SUMMARIES[kind_of(benchmark)](truths, found), str(benchmark["key_sha256"]), out)


def _older(out: Path) -> list[Path]:
    figures = "confusion|inversion|by_size|calibration|found_by_size|families"
    return matching(out, r"scores\.(json|md)", rf"({figures})\.(png|pdf)")


_SINGLE_SIZE = """
A size is the RMS over all samples of the residual after the base model was refitted, by class: the highest of 0.5, 1, 2
and 4 % F0 of which it reaches 85 %. Intervals of shares: Clopper–Pearson.
"""
_COMPOSITE_SIZE = """
A size is the unique contribution of a mechanism: the RMS over all samples of the residual if the model has everything
else that is there, and constants, the others' scales and ordinary measurement artefacts are fitted again; classes by
their least size. A component of several members counts once, by its family, and is never right by name. Intervals:
Clopper–Pearson; of calibration errors: bootstrap over cases.
"""


class Summary(NamedTuple):
    """What is reported of a benchmark: scores, and what ``scores.json``, ``scores.md`` and figures hold besides."""

    scores: list[Score]
    tree: dict[str, Any]
    section: str
    draw: Callable[[Path], list[Path]]


def _of_singles(truths: Sequence[Mapping[str, Any]], found: Mapping[str, Answer]) -> Summary:
    judged = [judge(truth, found[truth["case"]]) for truth in truths]
    singles = [j for j in judged if j.kind == "single" and j.size_class_f0 is not None]
    hits: dict[str, Callable[[JudgedSingle], bool]] = {
        "family": lambda j: j.family, "exact": lambda j: j.exact, "physics": lambda j: j.says(Verdict.PHYSICS)
    }  # fmt: skip
    sizes = by_size(singles, lambda j: j.size_class_f0 or 0.0, hits)
    stated = [Stated(j.confidence, j.exact) for j in judged if j.confidence is not None and j.answer != j.verdict]
    bins = reliability([stated], _CONFIDENCE_BINS)
    brier = float(np.mean([(s.probability - s.right) ** 2 for s in stated])) if stated else None
    tree = {"by_size": sizes, "calibration": {"n": len(stated), "brier": brier, "bins": bins}, "judged": judged}
    heads = {"family": "family first", "exact": "mechanism first", "physics": "verdict physics"}
    section = _sizes("Single effects", sizes, heads) + _SINGLE_SIZE
    return Summary(of_singles(judged), tree, section, lambda folder: draw_singles(folder, judged, sizes, bins))


def _of_composites(truths: Sequence[Mapping[str, Any]], found: Mapping[str, Answer]) -> Summary:
    judged = [judge_composite(truth, found[truth["case"]]) for truth in truths]
    hits: dict[str, Callable[[JudgedEffect], bool]] = {
        "family": lambda e: e.family_found, "exact": lambda e: e.exact_found
    }  # fmt: skip
    sizes = by_size([effect for j in judged for effect in j.effects], lambda e: e.size_f0, hits)
    bins, errors = reliability(as_stated(j.statements) for j in judged), calibration.of_composites(judged)
    error = errors[0]
    words = (
        f"expected calibration error {error.value:.3f}\n95 % interval {error.lower:.3f} to {error.upper:.3f}"
        if error.value is not None
        else ""
    )
    tree = {"by_size": sizes, "calibration": bins, "judged": judged}
    section = _sizes("Effects", sizes, {"family": "family in the answer", "exact": "name in the answer"})
    return Summary(
        of_composites(judged, errors), tree, section + _COMPOSITE_SIZE,
        lambda folder: draw_composites(folder, judged, sizes, bins, words),
    )  # fmt: skip


_SUMMARIES: Mapping[str, Callable[[Sequence[Mapping[str, Any]], Mapping[str, Answer]], Summary]] = {
    SINGLES: _of_singles,
    COMPOSITES: _of_composites,
}


def _write(summary: Summary, key_sha256: str, out: Path) -> tuple[str, list[Path]]:
    """Write scores, tables and figures; see `score`."""
    remove_results(_older(out))
    tree = {
        "key_sha256": key_sha256,
        "cases": len(summary.tree["judged"]),
        "scores": {s.name: {**s._asdict(), "reached": s.reached} for s in summary.scores},
        **summary.tree,
    }
    text = table(summary.scores)
    page = f"# Scores of {tree['cases']} concealed cases\n\nKey: SHA-256 {key_sha256}\n\n{text}\n\n{summary.section}"
    write_json(out / "scores.json", tree)
    write_text(out / "scores.md", page)
    return text, [out / "scores.json", out / "scores.md", *summary.draw(out)]


def table(found: Sequence[Score]) -> str:
    """Scores as Markdown."""
    columns: Columns[Score] = {
        "score": lambda s: s.meaning,
        "value": lambda s: _number(s, s.value),
        "95 % interval": lambda s: "" if s.lower is None else f"{_number(s, s.lower)} to {_number(s, s.upper)}",
        "cases": lambda s: str(s.n),
        "bar": lambda s: "" if s.bar is None else f"{'≤' if s.at_most else '≥'} {_number(s, s.bar)}",
        "reached": lambda s: {True: "yes", False: "no", None: ""}[s.reached],
    }
    return markdown(*filled(columns, found))


def _number(s: Score, value: float | None) -> str:
    # All but these are shares of cases.
    decimals = 2 if s.name == "gain" else 3 if s.name.startswith("calibration") else None
    return _share(value) if decimals is None else number(value, f".{decimals}f")


def _share(value: float | None) -> str:
    return number(value, ".0%").replace("%", " %")


def _sizes(what: str, rows: Sequence[Mapping[str, Any]], heads: Mapping[str, str]) -> str:
    """Shares by class of size as Markdown; heads by name of the share."""
    cells = [
        [
            f"{100.0 * row['from_f0']:g} % F0" if row["from_f0"] else "below 0.5 % F0",
            str(row["n"]),
            *(_share(row[name]["value"]) for name in heads),
        ]
        for row in rows
    ]
    return f"## {what} by size\n\n{markdown(['size', 'cases', *heads.values()], cells)}\n"
