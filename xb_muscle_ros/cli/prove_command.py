"""``xb_muscle prove``: conceal effects in made or real recordings, diagnose them blind, score the diagnoses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_overwrite, add_work, work_options_of
from xb_muscle_ros.prove.sealing import KINDS, SINGLES

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers
    from xb_muscle_ros.work import Options


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "prove",
        help="test diagnoses blind: conceal effects, diagnose, score",
        description="A blinded benchmark of 'xb_muscle diagnose'. make: studies of made fibres with concealed effects "
        "and a sealed key. run: diagnose them, without the key. score: open the key and count.",
    )
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")
    make = steps.add_parser("make", help="make cases with concealed effects, and a sealed key")
    make.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the benchmark")
    make.add_argument("--cases", type=int, required=True, metavar="N", help="how many")
    make.add_argument("--seed", type=int, required=True, metavar="S", help="decides everything: keep it as the key")
    make.add_argument("--key", type=Path, required=True, metavar="FILE", help="file for the truths, outside of DIR")
    make.add_argument(
        "--kind", choices=KINDS, default=SINGLES,
        help="singles: at most one thing or a pair is concealed; composites: up to four mechanisms, each case with "
        "ordinary measurement artefacts (default: singles)",
    )  # fmt: skip
    make.add_argument("--method", default="gaussian", help="method that the fibre files name (default: gaussian)")
    add_overwrite(make)
    add_work(make)
    make.set_defaults(run=_make)
    spike = steps.add_parser("spike", help="add the force of concealed effects to a recorded study")
    spike.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="trials of one fibre, or a folder of them")
    spike.add_argument("--fiber", "--fibre", dest="fiber", type=Path, required=True, metavar="FILE", help="fibre file")
    spike.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the benchmark")
    spike.add_argument("--cases", type=int, required=True, metavar="N", help="how many")
    spike.add_argument("--seed", type=int, required=True, metavar="S", help="decides everything: keep it as the key")
    spike.add_argument("--key", type=Path, required=True, metavar="FILE", help="file for the truths, outside of DIR")
    add_overwrite(spike)
    add_work(spike)
    spike.set_defaults(run=_spike)
    run = steps.add_parser("run", help="diagnose every case, without the key")
    run.add_argument("folder", type=Path, metavar="DIR", help="folder of the benchmark")
    run.add_argument("--out", type=Path, required=True, metavar="RESULTS", help="folder for the diagnoses")
    run.add_argument("--quick", action="store_true", help="the tool's quick way")
    run.add_argument("--tool-seed", type=int, default=1, metavar="S", help="seed of the tool (default: 1)")
    add_overwrite(run)
    add_work(run)
    run.set_defaults(run=_run)
    score = steps.add_parser("score", help="open the key and score the diagnoses")
    score.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'prove run' wrote")
    score.add_argument("--key", type=Path, required=True, metavar="FILE", help="the key")
    score.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for scores and figures")
    add_overwrite(score)
    score.set_defaults(run=_score)


def _make(arguments: argparse.Namespace) -> int:
    """Make a benchmark and print the key's hash."""
    from xb_muscle_ros.prove.make import make

    options = _checked(arguments, "prove make")
    sealed = make(
        arguments.out, arguments.cases, arguments.seed, arguments.key, arguments.method, options, arguments.overwrite,
        arguments.kind,
    )  # fmt: skip
    return _sealed(arguments, sealed)


def _spike(arguments: argparse.Namespace) -> int:
    """Make spike-ins and print the key's hash."""
    from xb_muscle_ros.prove.spike import spike

    options = _checked(arguments, "prove spike")
    sealed = spike(
        arguments.bags,
        arguments.fiber,
        arguments.out,
        arguments.cases,
        arguments.seed,
        arguments.key,
        options,
        arguments.overwrite,
    )
    return _sealed(arguments, sealed)


def _journal(arguments: argparse.Namespace) -> Path:
    """Kept beside the key, because it holds what the key does."""
    key: Path = arguments.key
    return key.with_name(f".{key.name}.journal")


def _checked(arguments: argparse.Namespace, label: str) -> Options:
    from xb_muscle_ros.errors import UserError

    if not 1 <= arguments.cases <= 9999:
        raise UserError(f"--cases is {arguments.cases}; allowed is 1 to 9999")
    if arguments.seed < 0:
        raise UserError(f"--seed is {arguments.seed}; allowed is 0 and above")
    return work_options_of(arguments, label, _journal(arguments))


def _sealed(arguments: argparse.Namespace, sealed: str) -> int:
    _journal(arguments).unlink(missing_ok=True)
    print(f"{arguments.out}: {arguments.cases} cases; key {arguments.key}, SHA-256 {sealed}")
    return 0


def _run(arguments: argparse.Namespace) -> int:
    """Diagnose all cases; 1 where the tool failed on some."""
    from xb_muscle_ros.cli.common import warn
    from xb_muscle_ros.prove.run import RESULTS, run

    options = work_options_of(arguments, "prove run")
    results = run(arguments.folder, arguments.out, arguments.quick, arguments.tool_seed, options, arguments.overwrite)
    failed = {name: found["error"] for name, found in results["cases"].items() if "error" in found}
    for name, why in failed.items():
        warn(f"{name}: {why}")
    print(f"{arguments.out / RESULTS}: {len(results['cases'])} cases, {len(failed)} that the tool could not do")
    return 1 if failed else 0


def _score(arguments: argparse.Namespace) -> int:
    """Score, print the table, write scores and figures."""
    from xb_muscle_ros.prove.score import score

    text, files = score(arguments.results, arguments.key, arguments.out, arguments.overwrite)
    print(text)
    for path in files:
        print(path)
    return 0
