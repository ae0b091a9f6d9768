"""A benchmark scored: the key opened, its hash checked, diagnoses counted, tables and figures written."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json, write_text
from xb_muscle_ros.prove.counting import Score
from xb_muscle_ros.prove.run import RESULTS
from xb_muscle_ros.prove.sealing import COMPOSITES, SINGLES, kind_of, load_benchmark, open_key
from xb_muscle_ros.tables import Columns, filled, markdown, number
from xb_muscle_ros.trials.bag_files import remove_results


def score(results: Path, key: Path, out: Path, overwrite: bool = False) -> tuple[str, list[Path]]:
    """Score the results of `prove run`.

    Args:
        results: folder with ``results.json`` and ``benchmark.json``.
        key: its hash must be the one of ``benchmark.json``.
        out: gets ``scores.json``, ``scores.md`` and figures.
        overwrite: replace older scores.

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
        found = json.loads(path.read_text(encoding="utf-8"))["cases"]
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
A size is the RMS over all samples of what is left after the base model was refitted, by class: the highest of 0.5, 1, 2
and 4 % F0 of which it reaches 85 %. Intervals of shares: Clopper–Pearson.
"""
_COMPOSITE_SIZE = """
A size is the RMS over all samples of what a mechanism leaves if the model has everything else that is there, and
constants, the others' scales and ordinary errors of the measurement are fitted again; classes by their least size.
A component of several members counts once, by its family, and is never right by name. Intervals: Clopper–Pearson; of
calibration errors: bootstrap over cases.
"""


class Summary(NamedTuple):
    """What is told of a benchmark.

    Attributes:
        scores: those with a bar first.
        tree: what ``scores.json`` holds besides.
        section: what ``scores.md`` holds besides.
        draw: draws figures into a folder and returns their paths.
    """

    scores: list[Score]
    tree: dict[str, Any]
    section: str
    draw: Callable[[Path], list[Path]]


def _of_singles(truths: Sequence[Mapping[str, Any]], found: Mapping[str, Any]) -> Summary:
    from xb_muscle_ros.prove.counting import by_size, calibration, scores
    from xb_muscle_ros.prove.judging import judge
    from xb_muscle_ros.prove.score_figures import draw

    judged = [judge(truth, found[truth["case"]]) for truth in truths]
    sizes = by_size(judged)
    tree = {"by_size": sizes, "calibration": calibration(judged), "judged": [j._asdict() for j in judged]}
    heads = ("family first", "mechanism first", "verdict physics")
    section = _sizes("Single effects", sizes, "size_class_f0", heads, ("family", "exact", "physics"))
    return Summary(scores(judged), tree, section + _SINGLE_SIZE, lambda folder: draw(folder, judged, tree))


def _of_composites(truths: Sequence[Mapping[str, Any]], found: Mapping[str, Any]) -> Summary:
    from xb_muscle_ros.prove.calibration import reliability
    from xb_muscle_ros.prove.composite_counting import as_stated, by_size, scores
    from xb_muscle_ros.prove.composite_figures import draw
    from xb_muscle_ros.prove.composite_judging import judge_composite

    judged = [judge_composite(truth, found[truth["case"]]) for truth in truths]
    sizes, bins, counted = by_size(judged), reliability([as_stated(j.statements) for j in judged]), scores(judged)
    tree = {"by_size": sizes, "calibration": bins, "judged": [j.as_json() for j in judged]}
    section = _sizes("Effects", sizes, "from_f0", ("family in the answer", "name in the answer"), ("family", "exact"))
    error = next(s for s in counted if s.name == "calibration")
    return Summary(
        counted, tree, section + _COMPOSITE_SIZE, lambda folder: draw(folder, judged, sizes, bins, error)
    )  # fmt: skip


_SUMMARIES: Mapping[str, Callable[[Sequence[Mapping[str, Any]], Mapping[str, Any]], Summary]] = {
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


# Scores that are no share of cases, with their decimals.
_DECIMALS = {
    "gain": 2,
    "calibration": 3,
    "calibration_families": 3,
    "calibration_components": 3,
    "calibration_exact": 3,
    "calibration_artefacts": 3,
}


def _number(s: Score, value: float | None) -> str:
    return number(value, f".{_DECIMALS[s.name]}f") if s.name in _DECIMALS else number(value, ".0%").replace("%", " %")


def _sizes(what: str, rows: Sequence[Mapping[str, Any]], size: str, heads: Sequence[str], names: Sequence[str]) -> str:
    """Shares by class of size as Markdown."""
    cells = [
        [
            f"{100.0 * row[size]:g} % F0" if row[size] else "below 0.5 % F0",
            str(row["n"]),
            *(number(row[name]["value"], ".0%").replace("%", " %") for name in names),
        ]
        for row in rows
    ]
    return f"## {what} by size\n\n{markdown(['size after a refit', 'cases', *heads], cells)}\n"
