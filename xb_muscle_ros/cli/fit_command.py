"""``xb_muscle fit``: the parameters of a fibre from its recordings, and how well they are known."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import (
    add_fibre,
    add_overwrite,
    add_reading,
    add_work,
    warn,
)
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EPILOG = """RULE is KEY=VALUE with KEY one of trial (VALUE may have * and ?), pca, amplitude (L0), recovery (s): a
trial meets it within what such conditions vary by. Faults of the measurement are pca_shift (per solution), length_gain,
run_down, time_shift, transducer_lag (per study), force_offset and force_drift (per trial); ordinary are all but
transducer_lag and force_drift."""


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "fit",
        help="estimate a fibre's parameters from recordings",
        description="Fit a model to the measured force of trials; writes a fibre file, fit.json and figures.",
        epilog=_EPILOG,
    )
    parser.add_argument("bags", nargs="*", metavar="BAG", help="bags or folders of bags, in the order of recording")
    add_fibre(parser)
    add_reading(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="fibre file to write")
    parser.add_argument("--hold-out", nargs="+", default=[], metavar="RULE", help="keep these trials out of the fit")
    parser.add_argument("--train", nargs="+", default=[], metavar="RULE", help="fit to these trials only")
    parser.add_argument("--split", choices=("paper",), help="the paper's two protocols are fitted, the others held out")
    parser.add_argument(
        "--window", choices=("paper", "whole"), default="paper", help="force that counts (default: paper)"
    )
    parser.add_argument("--weight", nargs="+", default=[], metavar="TRIAL=W", help="weights of trials (default: 1)")
    parser.add_argument(
        "--free",
        nargs="+",
        metavar="NAME",
        help="parameters to fit (default: those the paper fitted, and those of mechanisms)",
    )
    parser.add_argument("--fix", nargs="+", default=[], metavar="NAME", help="parameters that keep their start value")
    parser.add_argument("--tie", nargs="+", default=[], metavar="A=B", help="parameter A takes the value of B")
    parser.add_argument("--bound", nargs="+", default=[], metavar="NAME=LO:HI", help="bounds of parameters")
    parser.add_argument(
        "--prior", nargs="+", default=[], metavar="NAME=MEAN:SD",
        help="prior; of positive parameters log-normal with SD as a share; inf: none (default: a factor of e)",
    )  # fmt: skip
    errors = parser.add_mutually_exclusive_group()
    errors.add_argument(
        "--nuisance", nargs="+", metavar="FAULT[=SD]",
        help="faults of the measurement to fit beside the parameters; 'ordinary' for those that every set has a little "
        "of (default), 'all' for all of them, 'none' for none",
    )  # fmt: skip
    errors.add_argument(
        "--no-nuisance", dest="nuisance", action="store_const", const=["none"], help="the same as --nuisance none"
    )
    parser.add_argument(
        "--prior-fibers",
        nargs="+",
        default=[],
        metavar="FIBER",
        help="priors from what these other fibres' sets are like",
    )
    parser.add_argument(
        "--features", type=Path, metavar="JSON", help="measured SRS and isometric force to meet as well"
    )
    parser.add_argument("--features-of", metavar="FIBER", help="whose features (default: the fibre of the trials)")
    parser.add_argument("--force-pca-only", action="store_true", help="of the features, isometric force alone")
    parser.add_argument(
        "--no-anchor", action="store_true", help="do not ask for an isometric force of 1 F0 (SD 0.02) at pCa 4.5"
    )
    parser.add_argument("--starts", type=int, default=4, help="descents from different points (default 4)")
    parser.add_argument("--seed", type=int, default=1, help="of the random starts (default 1)")
    parser.add_argument("--level", type=float, default=0.95, help="of the intervals (default 0.95)")
    parser.add_argument(
        "--no-intervals", action="store_true", help="leave the profiles out: the longest part of the work"
    )
    add_overwrite(parser)
    add_work(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Fit, print the tables, write the files."""
    from xb_muscle_ros.api.fitting import check_out, fit, number

    folder = check_out(arguments.out, arguments.overwrite)
    found = fit(
        arguments.bags,
        arguments.fiber,
        model=arguments.model,
        method=arguments.method,
        set=dict(arguments.changes),
        reference_length=arguments.reference_length,
        f0=arguments.f0,
        trials_of=arguments.trials_of,
        hold_out=arguments.hold_out,
        train=arguments.train,
        split=arguments.split,
        window=arguments.window,
        weight={name: number(value, f"--weight {name}") for name, value in _pairs(arguments.weight, "--weight")},
        free=arguments.free,
        fix=arguments.fix,
        tie=dict(_pairs(arguments.tie, "--tie")),
        bound={name: _range(value, f"--bound {name}") for name, value in _pairs(arguments.bound, "--bound")},
        prior={name: _range(value, f"--prior {name}") for name, value in _pairs(arguments.prior, "--prior")},
        nuisance=arguments.nuisance,
        prior_fibers=arguments.prior_fibers,
        features=arguments.features,
        features_of=arguments.features_of,
        force_pca_only=arguments.force_pca_only,
        anchor=not arguments.no_anchor,
        starts=arguments.starts,
        seed=arguments.seed,
        level=arguments.level,
        intervals=not arguments.no_intervals,
        processes=arguments.processes,
        scheduler=arguments.scheduler,
        journal=folder / "journal.jsonl",
        progress=True,
        tell=warn,
    )
    print(found.table)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0


def _pairs(given: list[str], option: str) -> list[tuple[str, str]]:
    pairs = [text.partition("=") for text in given]
    for text, (name, _, value) in zip(given, pairs, strict=True):
        if not name or not value:
            raise UserError(f"{option} {text}: needed is NAME=VALUE")
        if sum(other == name for other, _, _ in pairs) > 1:
            raise UserError(f"{option} {name} is given more than once; give it once")
    return [(name, value) for name, _, value in pairs]


def _range(text: str, where: str) -> tuple[float, float]:
    from xb_muscle_ros.api.fitting import number

    low, colon, high = text.partition(":")
    if not colon:
        raise UserError(f"{where}={text}: needed are two numbers with a colon between them")
    return number(low, where), number(high, where)
