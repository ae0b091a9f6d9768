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
from xb_muscle_ros.prove.answers import row_of
from xb_muscle_ros.prove.sealing import BENCHMARK, load_benchmark
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.work import JsonValue, Options, stream

RESULTS = "results.json"
_JOURNAL = "run.journal"


def run(folder: Path, out: Path, quick: bool, seed: int, options: Options, overwrite: bool = False) -> dict[str, Any]:
    """Diagnose all cases; a run that was stopped goes on where it was.

    Args:
        out: gets one folder of a diagnosis for each case, ``results.json`` and a copy of ``benchmark.json``.
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
    from xb_muscle_ros.diagnose.intake import read_fibres
    from xb_muscle_ros.diagnose.outputs import write
    from xb_muscle_ros.diagnose.run import diagnose

    folder, out = Path(task["folder"]), Path(task["out"])
    options = Options(processes=0, quiet=True, journal=out / "journal.jsonl")
    start = time.perf_counter()
    try:
        studies = read_fibres([folder / "bags"], [folder / "fibre.yaml"])
        found, files = diagnose(studies, bool(task["quick"]), int(task["seed"]), options)
        write(out, found, files, report=False)
    except UserError as error:
        return {"error": str(error), "seconds": time.perf_counter() - start}
    return {**row_of(found), "seconds": time.perf_counter() - start}
