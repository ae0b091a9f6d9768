"""A benchmark made: bags and a fibre file for each case, and a key that nobody opens before the scoring."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older, write_json
from xb_muscle_ros.prove.sealing import BENCHMARK, COMPOSITES, SINGLES, digest, kind_of, load_benchmark, older_cases
from xb_muscle_ros.trials.bag_files import remove_results
from xb_muscle_ros.work import JsonValue, Options, stream

VERSION = 2
_STUDIES = "Studies of made fibres, each with its bags and a fibre file that was fitted to another fibre"
_SEALED = "The key was sealed when the cases were made: its SHA-256 is below."
_ABOUT = {
    SINGLES: f"{_STUDIES}. In some something is concealed: a mechanism, an effect that has no name, or a fault of the "
    f"measurement; in some nothing. {_SEALED}",
    COMPOSITES: f"{_STUDIES}, all recorded with ordinary error of the measurement. In most something is concealed: one "
    "mechanism or several, an effect that has no name, or artefacts of the measurement beyond the ordinary; in some "
    f"nothing. {_SEALED}",
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
        cases: how many.
        seed: decides everything; who knows it knows the key.
        key: file for the truths; must not lie in `out`.
        method: how the fibre files say that heads are distributed over strain.
        options: where to work; the journal is kept beside the key until all is done.
        overwrite: replace another benchmark and its key.
        kind: one of `sealing.KINDS`.

    Returns:
        SHA-256 of the key file.

    Raises:
        UserError: the folder holds another benchmark, the key lies in it, or a file cannot be written.
    """
    if out.resolve() in key.resolve().parents:
        raise UserError(f"key {key} lies within {out}, where the tool would find it; choose a file elsewhere")
    if (out / BENCHMARK).exists() and not overwrite:
        return _finished(out, cases, seed, key, kind)
    refuse_older([] if not key.exists() else [key], overwrite)
    remove_results(older_cases(out))
    tasks = [_task(out, number, cases, seed, method, kind) for number in range(1, cases + 1)]
    found: dict[int, Any] = dict(stream(_make_one, tasks, options))
    for index, task in enumerate(tasks):
        # The journal may know a case whose folder was deleted.
        if not (Path(str(task["out"])) / "fibre.yaml").exists():
            found[index] = _make_one(task)
    return seal(out, key, seed, [found[index] for index in range(cases)], _ABOUT[kind], method, kind)


def seal(out: Path, key: Path, seed: int, entries: list[Any], about: str, method: str, kind: str = SINGLES) -> str:
    """Write the key and the benchmark's public description; returns the key's SHA-256."""
    salt = hashlib.sha256(f"salt of the key, seed {seed}".encode()).hexdigest()
    # Keys of single effects stay what they were, to the last byte.
    of_kind = {} if kind == SINGLES else {"kind": kind}
    content = {"version": VERSION, **of_kind, "salt": salt, "seed": seed, "cases": entries}
    write_json(key, content)
    sealed = digest(key)
    public = {
        "version": VERSION, **of_kind, "about": about, "method": method, "cases": [entry["case"] for entry in entries],
        "key_sha256": sealed,
    }  # fmt: skip
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
    return _MAKERS[str(task["kind"])](task)


def _single(task: Mapping[str, Any]) -> dict[str, JsonValue]:
    from xb_muscle_ros.prove.generator.case import make_case
    from xb_muscle_ros.prove.generator.mix import specs
    from xb_muscle_ros.prove.generator.writing import key_entry, write_case

    number, folder = int(task["number"]), Path(task["out"])
    spec = specs(int(task["cases"]), int(task["seed"]))[number - 1]
    case = make_case(spec, int(task["seed"]), number)
    write_case(folder, case, f"fibre_{number:04d}", str(task["method"]))
    return key_entry(case, folder.name)


def _composite(task: Mapping[str, Any]) -> dict[str, JsonValue]:
    from xb_muscle_ros.prove.generator.composite import make_composite
    from xb_muscle_ros.prove.generator.composite_mix import composite_specs
    from xb_muscle_ros.prove.generator.writing import composite_entry, write_case

    number, folder = int(task["number"]), Path(task["out"])
    spec = composite_specs(int(task["cases"]), int(task["seed"]))[number - 1]
    case = make_composite(spec, int(task["seed"]), number)
    write_case(folder, case, f"fibre_{number:04d}", str(task["method"]))
    return composite_entry(case, folder.name)


_MAKERS: Mapping[str, Callable[[Mapping[str, Any]], dict[str, JsonValue]]] = {SINGLES: _single, COMPOSITES: _composite}
