"""A benchmark made: bags and a fibre file for each case, and a key that nobody opens before the scoring."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older, write_json
from xb_muscle_ros.prove.sealing import (
    BENCHMARK,
    COMPOSITES,
    SINGLES,
    VERSION,
    digest,
    kind_of,
    load_benchmark,
    older_cases,
)
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.work import JsonValue, Options, stream

_STUDIES = "Studies of made fibres, each with its bags and a fibre file that was fitted to another fibre"
SEALED = "The key was sealed when the cases were made: its SHA-256 is below."
_ABOUT = {
    SINGLES: f"{_STUDIES}. In some something is concealed: a mechanism, an effect that has no name, or a measurement "
    f"artefact; in some nothing. {SEALED}",
    COMPOSITES: f"{_STUDIES}, all recorded with ordinary measurement artefacts. In most something is concealed: one "
    "mechanism or several, an effect that has no name, or measurement artefacts beyond the ordinary; in some "
    f"nothing. {SEALED}",
}


def case_name(number: int) -> str:
    """Name of a case's folder; numbers begin at 1."""
    return f"case_{number:04d}"


def make(
    out: Path, cases: int, seed: int, key: Path, method: str, options: Options, overwrite: bool = False,
    kind: str = SINGLES,
) -> str:  # fmt: skip
    """Make a benchmark; a run that was stopped goes on where it was.

    Args:
        out: folder; gets ``cases/`` and ``benchmark.json``.
        seed: decides everything; who knows it knows the key.
        key: file for the truths; must not lie in `out`.
        method: how the fibre files say that heads are distributed over strain.
        options: where to work; the journal is kept beside the key until all is done.
        overwrite: replace another benchmark and its key.

    Returns:
        SHA-256 of the key file.

    Raises:
        UserError: the folder holds another benchmark, the key lies in it, or a file cannot be written.
    """
    if (out / BENCHMARK).exists() and not overwrite:
        _refuse_within(key, out)
        return _finished(out, cases, seed, key, kind)
    make_room(out, key, overwrite)
    tasks = [_task(out, number, cases, seed, method, kind) for number in range(1, cases + 1)]
    found: dict[int, Any] = dict(stream(_make_one, tasks, options))
    for index, task in enumerate(tasks):
        # The journal may know a case whose folder was deleted.
        if not (Path(str(task["out"])) / "fibre.yaml").exists():
            found[index] = _make_one(task)
    return seal(out, key, seed, [found[index] for index in range(cases)], _ABOUT[kind], method, kind)


def make_room(out: Path, key: Path, overwrite: bool) -> None:
    """Remove what an older benchmark left, if it may be.

    Raises:
        UserError: the key lies in the folder, or there is an older benchmark or key.
    """
    _refuse_within(key, out)
    refuse_older([path for path in (out / BENCHMARK, key) if path.exists()], overwrite)
    remove_results(older_cases(out))


def _refuse_within(key: Path, out: Path) -> None:
    if out.resolve() in key.resolve().parents:
        raise UserError(f"key {key} lies within {out}, where the tool would find it; choose a file elsewhere")


def seal(out: Path, key: Path, seed: int, entries: list[Any], about: str, method: str, kind: str = SINGLES) -> str:
    """Write the key and the benchmark's public description; returns the key's SHA-256."""
    salt = hashlib.sha256(f"salt of the key, seed {seed}".encode()).hexdigest()
    write_json(key, {"version": VERSION, "kind": kind, "salt": salt, "seed": seed, "cases": entries})
    sealed = digest(key)
    public = {
        "version": VERSION,
        "kind": kind,
        "about": about,
        "method": method,
        "cases": [entry["case"] for entry in entries],
        "key_sha256": sealed,
    }
    write_json(out / BENCHMARK, public)
    return sealed


def _finished(out: Path, cases: int, seed: int, key: Path, kind: str) -> str:
    """The hash of a benchmark that is made already, if it is the one asked for."""
    public = load_benchmark(out)
    known = (
        key.exists()
        and digest(key) == public["key_sha256"]
        and len(public["cases"]) == cases
        and kind_of(public) == kind
    )
    if known and json.loads(key.read_text(encoding="utf-8"))["seed"] == seed:
        return str(public["key_sha256"])
    raise UserError(f"{out} holds another benchmark already; use --overwrite to replace it or choose another folder")


def _task(out: Path, number: int, cases: int, seed: int, method: str, kind: str) -> dict[str, JsonValue]:
    folder = out / "cases" / case_name(number)
    return {"number": number, "cases": cases, "seed": seed, "method": method, "kind": kind, "out": str(folder)}


def _make_one(task: Mapping[str, Any]) -> dict[str, JsonValue]:
    """Make one case, write what is public of it, and return what the key says."""
    from xb_muscle_ros.prove.generator import mix
    from xb_muscle_ros.prove.generator.composite import make_composite
    from xb_muscle_ros.prove.generator.single import make_single
    from xb_muscle_ros.prove.generator.writing import key_entry, write_case

    number, seed, folder = int(task["number"]), int(task["seed"]), Path(task["out"])
    composite = task["kind"] == COMPOSITES
    specs = (mix.composites if composite else mix.singles)(int(task["cases"]), seed)
    case = (make_composite if composite else make_single)(specs[number - 1], seed, number)
    write_case(folder, case, f"fibre_{number:04d}", str(task["method"]))
    return key_entry(case, folder.name)
