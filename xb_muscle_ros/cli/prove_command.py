"""``xb_muscle prove``: conceal effects in made or real recordings, diagnose them blind, score the diagnoses."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.sealing import KINDS, SINGLES

if TYPE_CHECKING:
    from xb_muscle_ros.work import Options

DESCRIPTION = (
    "A blinded benchmark of 'xb_muscle diagnose'. make: studies of made fibres with concealed effects and a sealed "
    "key. spike: the same with recordings. run: diagnose them, without the key. score: open the key and count."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of all steps."""
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")
    for name, step in STEPS.items():
        one = steps.add_parser(name, help=step.help, description=step.help)
        step.arguments(one)
        one.set_defaults(run=step.run)


def _add_sealed(parser: argparse.ArgumentParser) -> None:
    """Arguments of steps that make a benchmark."""
    common.add_out(parser, "folder of the benchmark")
    parser.add_argument("--cases", type=int, required=True, metavar="N", help="how many")
    parser.add_argument("--seed", type=int, required=True, metavar="S", help="decides everything: keep it as the key")
    parser.add_argument("--key", type=Path, required=True, metavar="FILE", help="file for the truths, outside of DIR")
    common.add_work(parser)


def _make_arguments(parser: argparse.ArgumentParser) -> None:
    _add_sealed(parser)
    parser.add_argument(
        "--kind", choices=KINDS, default=SINGLES,
        help="singles: at most one thing or a pair is concealed; composites: up to four mechanisms, each case with "
        "ordinary measurement artefacts (default singles)",
    )  # fmt: skip
    parser.add_argument("--method", default="gaussian", help="method that the fibre files name (default gaussian)")


def _spike_arguments(parser: argparse.ArgumentParser) -> None:
    common.add_bags(parser)
    common.add_fibre(parser, type=Path, required=True, metavar="FILE", help="fibre file")
    _add_sealed(parser)


def _run_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the benchmark")
    common.add_out(parser, "folder for the diagnoses", metavar="RESULTS")
    parser.add_argument("--quick", action="store_true", help="diagnose less thoroughly, see diagnose --quick")
    parser.add_argument("--tool-seed", type=int, default=1, metavar="S", help="seed of the tool (default 1)")
    common.add_work(parser)


def _score_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'prove run' wrote")
    parser.add_argument("--key", type=Path, required=True, metavar="FILE", help="the key")
    common.add_out(parser, "folder for scores and figures")


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
        arguments.bags, arguments.fiber, arguments.out, arguments.cases, arguments.seed, arguments.key, options,
        arguments.overwrite,
    )  # fmt: skip
    return _sealed(arguments, sealed)


def _journal(arguments: argparse.Namespace) -> Path:
    """Kept beside the key, because it holds what the key does."""
    key: Path = arguments.key
    return key.with_name(f".{key.name}.journal")


def _checked(arguments: argparse.Namespace, label: str) -> Options:
    if not 1 <= arguments.cases <= 9999:
        raise UserError(f"--cases is {arguments.cases}; allowed is 1 to 9999")
    if arguments.seed < 0:
        raise UserError(f"--seed is {arguments.seed}; allowed is 0 and above")
    return common.work_options_of(arguments, label, _journal(arguments))


def _sealed(arguments: argparse.Namespace, sealed: str) -> int:
    _journal(arguments).unlink(missing_ok=True)
    print(f"{arguments.out}: {arguments.cases} cases; key {arguments.key}, SHA-256 {sealed}")
    return 0


def _run(arguments: argparse.Namespace) -> int:
    """Diagnose all cases; 1 where the tool failed on some."""
    from xb_muscle_ros.prove.run import RESULTS, run

    options = common.work_options_of(arguments, "prove run")
    results = run(arguments.folder, arguments.out, arguments.quick, arguments.tool_seed, options, arguments.overwrite)
    failed = {name: found["error"] for name, found in results["cases"].items() if "error" in found}
    for name, why in failed.items():
        common.warn(f"{name}: {why}")
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


class Step(NamedTuple):
    """One step of a benchmark: what it does, its arguments, and how it is run."""

    help: str
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


STEPS = {
    "make": Step("make cases with concealed effects, and a sealed key", _make_arguments, _make),
    "spike": Step("add the force of concealed effects to a recorded study", _spike_arguments, _spike),
    "run": Step("diagnose every case, without the key", _run_arguments, _run),
    "score": Step("open the key and score the diagnoses", _score_arguments, _score),
}
