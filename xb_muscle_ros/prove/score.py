"""A benchmark scored: the key opened, its hash checked, diagnoses counted, tables and figures written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_text
from xb_muscle_ros.prove.counting import Score, by_size, calibration, scores
from xb_muscle_ros.prove.judging import Judged, judge
from xb_muscle_ros.prove.run import RESULTS
from xb_muscle_ros.prove.sealing import load_benchmark, open_key
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
    judged = [judge(truth, found[truth["case"]]) for truth in truths]
    return write(judged, str(benchmark["key_sha256"]), out)


def _older(out: Path) -> list[Path]:
    return matching(out, r"scores\.(json|md)", r"(confusion|inversion|by_size|calibration)\.(png|pdf)")


def write(judged: Sequence[Judged], key_sha256: str, out: Path) -> tuple[str, list[Path]]:
    """Write scores, tables and figures of judged cases; see `score`."""
    from xb_muscle_ros.prove.score_figures import draw

    remove_results(_older(out))
    found = scores(judged)
    tree = {
        "key_sha256": key_sha256,
        "cases": len(judged),
        "scores": {s.name: {**s._asdict(), "reached": s.reached} for s in found},
        "by_size": by_size(judged),
        "calibration": calibration(judged),
        "judged": [j._asdict() for j in judged],
    }
    text = table(found)
    write_text(out / "scores.json", json.dumps(tree, indent=1) + "\n")
    write_text(out / "scores.md", _page(tree, text))
    return text, [out / "scores.json", out / "scores.md", *draw(out, judged, tree)]


def table(found: Sequence[Score]) -> str:
    """Scores as Markdown."""
    rows = ["| score | value | 95 % interval | cases | bar | reached |", "|---|---|---|---|---|---|"]
    for s in found:
        told = {True: "yes", False: "no", None: ""}[s.reached]
        bar = "" if s.bar is None else f"{'≤' if s.at_most else '≥'} {_number(s, s.bar)}"
        between = "" if s.lower is None or s.upper is None else f"{_number(s, s.lower)} to {_number(s, s.upper)}"
        rows.append(f"| {s.meaning} | {_number(s, s.value)} | {between} | {s.n} | {bar} | {told} |")
    return "\n".join(rows)


def _number(s: Score, value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.2f}" if s.name == "gain" else f"{100.0 * value:.0f} %"


def _page(tree: dict[str, Any], text: str) -> str:
    """``scores.md``."""
    rows = [
        "| size after a refit | cases | family first | mechanism first | verdict physics |",
        "|---|---|---|---|---|",
    ]
    for row in tree["by_size"]:
        shares = (row[name]["value"] for name in ("family", "exact", "physics"))
        size = f"{100.0 * row['size_class_f0']:g} % F0" if row["size_class_f0"] else "below 0.5 % F0"
        cells = " | ".join("–" if value is None else f"{100.0 * value:.0f} %" for value in shares)
        rows.append(f"| {size} | {row['n']} | {cells} |")
    return (
        f"# Scores of {tree['cases']} concealed cases\n\nKey: SHA-256 {tree['key_sha256']}\n\n{text}\n\n"
        "## Single effects by size\n\n" + "\n".join(rows) + "\n\n"
        "A size is the RMS over all samples of what is left after the base model was refitted, by class: the highest "
        "of 0.5, 1, 2 and 4 % F0 of which it reaches 85 %. Intervals of shares: Clopper–Pearson.\n"
    )
