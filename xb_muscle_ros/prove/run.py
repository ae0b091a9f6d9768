"""A benchmark diagnosed: every case by the tool as a user would, never with the key."""

from __future__ import annotations

import hashlib
import re
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json
from xb_muscle_ros.prove.sealing import BENCHMARK, load_benchmark
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.work import JsonValue, Options, stream

RESULTS = "results.json"
_JOURNAL = "run.journal"


def run(folder: Path, out: Path, quick: bool, seed: int, options: Options, overwrite: bool = False) -> dict[str, Any]:
    """Diagnose all cases; a run that was stopped goes on where it was.

    Args:
        folder: of the benchmark.
        out: gets one folder of a diagnosis for each case, ``results.json`` and a copy of ``benchmark.json``.
        quick: the tool's quick way.
        seed: of the tool.
        options: where to work.
        overwrite: replace the results of an older run; diagnoses that the journal keeps are not done again.

    Returns:
        What ``results.json`` holds: by case, what the scoring needs of its diagnosis.

    Raises:
        UserError: the folder is no benchmark, or results cannot be written.
    """
    benchmark = load_benchmark(folder)
    tasks = [_task(folder, out, str(name), quick, seed) for name in benchmark["cases"]]
    refuse_older(matching(out, re.escape(RESULTS)), overwrite)
    found = dict(stream(_diagnose, tasks, replace(options, journal=options.journal or out / _JOURNAL)))
    results = {"quick": quick, "seed": seed, "cases": {task["case"]: found[i] for i, task in enumerate(tasks)}}
    remove_results(_stale(out, {str(name) for name in benchmark["cases"]}))
    write_json(out / RESULTS, results)
    write_json(out / BENCHMARK, benchmark)
    return results


def _stale(out: Path, cases: set[str]) -> list[Path]:
    """Diagnoses in a folder of results that are of cases of another benchmark."""
    from xb_muscle_ros.diagnose.outputs import older_results

    try:
        older = {str(name) for name in load_benchmark(out)["cases"]}
    except UserError:
        return []
    return [path for name in sorted(older - cases) for path in older_results(out / "cases" / name)]


def _task(folder: Path, out: Path, name: str, quick: bool, seed: int) -> dict[str, Any]:
    case = folder / "cases" / name
    content = hashlib.sha256()
    files = sorted(path for path in case.rglob("*") if path.is_file())
    if not files:
        raise UserError(f"case {name} is missing in {folder / 'cases'}; make the benchmark again")
    for path in files:
        content.update(path.relative_to(case).as_posix().encode() + b"\0" + path.read_bytes())
    return {
        "case": name, "folder": str(case), "content": content.hexdigest(), "out": str(out / "cases" / name),
        "quick": quick, "seed": seed,
    }  # fmt: skip


def _diagnose(task: Mapping[str, Any]) -> dict[str, JsonValue]:
    """Diagnose one case; a case that the tool cannot do is a result as well."""
    from xb_muscle_ros.diagnose.report.output import as_row
    from xb_muscle_ros.diagnose.run import diagnose_bags
    from xb_muscle_ros.trials.bags import find_bags

    folder = Path(task["folder"])
    start = time.perf_counter()
    try:
        found = diagnose_bags(
            find_bags([folder / "bags"]),
            folder / "fibre.yaml",
            Path(task["out"]),
            bool(task["quick"]),
            int(task["seed"]),
            report=False,
        )
    except UserError as error:
        return {"error": str(error), "seconds": time.perf_counter() - start}
    return {**needed(as_row(found)), "seconds": time.perf_counter() - start}


def needed(diagnosis: Mapping[str, Any]) -> dict[str, JsonValue]:
    """What the scoring needs of a ``diagnosis.json``."""
    mismatch = diagnosis.get("mismatch") or []
    before, after = (diagnosis.get(when) or {} for when in ("before", "after"))
    return {
        "verdict": diagnosis["verdict"],
        "answer": list(diagnosis.get("answer") or ()),
        "family": diagnosis.get("family"),
        "p_value": diagnosis.get("p_value"),
        "confidence": diagnosis.get("confidence"),
        **_components(diagnosis),
        "first_mismatch": {key: mismatch[0][key] for key in ("trial", "phase", "size_f0")} if mismatch else None,
        "before_heldout_f0": before.get("heldout_rmsd_f0"),
        "after_heldout_f0": after.get("heldout_rmsd_f0"),
    }


_OF_COMPONENT = ("name", "kind", "family", "members", "inclusion_probability", "log_odds", "contribution_f0")


def _components(diagnosis: Mapping[str, Any]) -> dict[str, JsonValue]:
    """What the scoring needs of the components; nothing in format 1, which has none."""
    rows = diagnosis.get("components")
    return (
        {} if rows is None else {"components": [{key: row[key] for key in _OF_COMPONENT if key in row} for row in rows]}
    )
