"""``xb_muscle fit``: the parameters of a fibre from its recordings, and how well they are known."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

DESCRIPTION = "Fit a model to the measured force of trials; writes a fibre file, fit.json and figures."
EPILOG = """RULE is KEY=VALUE with KEY one of trial (VALUE may have * and ?), pca, amplitude (L0), recovery (s): a
trial meets it within what such conditions vary by. Measurement artefacts are pca_shift (per solution), length_gain,
run_down, time_shift, transducer_lag (per study), force_offset and force_drift (per trial); ordinary are all but
transducer_lag and force_drift."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser, nargs="*")
    common.add_fibre(parser, required=True)
    common.add_model(parser)
    common.add_reading(parser)
    common.add_out(parser, "fibre file to write; the rest goes into a folder of its name", metavar="FILE")
    several: dict[str, Any] = {"nargs": "+", "default": []}
    what = parser.add_argument_group("what is fitted")
    what.add_argument("--hold-out", **several, metavar="RULE", help="keep these trials out of the fit")
    what.add_argument("--train", **several, metavar="RULE", help="fit to these trials only")
    what.add_argument("--split", choices=("paper",), help="the paper's two protocols are fitted, the others held out")
    what.add_argument(
        "--window",
        choices=("paper", "whole"),
        default="paper",
        help="part of the force that is fitted (default paper: around the stretches)",
    )
    what.add_argument("--weight", **several, metavar="TRIAL=W", help="weights of trials (default 1)")
    what.add_argument("--features", type=Path, metavar="JSON", help="measured SRS and isometric force to meet as well")
    what.add_argument("--features-of", metavar="FIBER", help="whose features (default: the fibre of the trials)")
    what.add_argument("--force-pca-only", action="store_true", help="of the features, isometric force alone")
    what.add_argument(
        "--no-anchor", dest="anchor", action="store_false",
        help="do not ask for an isometric force of 1 F0 (SD 0.02) at pCa 4.5",
    )  # fmt: skip
    of = parser.add_argument_group("parameters")
    of.add_argument(
        "--free", nargs="+", metavar="NAME",
        help="parameters to fit (default: those the paper fitted, and those of mechanisms)",
    )  # fmt: skip
    of.add_argument("--fix", **several, metavar="NAME", help="parameters that keep their start value")
    of.add_argument("--tie", **several, metavar="A=B", help="parameter A takes the value of B")
    of.add_argument("--bound", **several, metavar="NAME=LO:HI", help="bounds of parameters, in their units")
    of.add_argument(
        "--prior", **several, metavar="NAME=MEAN:SD",
        help="prior; of positive parameters log-normal with SD as a share; inf: none (default: a factor of e)",
    )  # fmt: skip
    of.add_argument(
        "--prior-fibers", **several, metavar="FIBER", help="priors from what these other fibres' sets are like"
    )
    errors = of.add_mutually_exclusive_group()
    errors.add_argument(
        "--nuisance", nargs="+", metavar="ARTEFACT[=SD]",
        help="measurement artefacts to fit beside the parameters, with SD in their units; 'ordinary' for those that "
        "every set has a little of (default), 'all' for all of them, 'none' for none",
    )  # fmt: skip
    errors.add_argument(
        "--no-nuisance", dest="nuisance", action="store_const", const=["none"], help="the same as --nuisance none"
    )
    how = parser.add_argument_group("how it is fitted")
    how.add_argument("--starts", type=int, default=4, metavar="N", help="descents from different points (default 4)")
    how.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the random starts (default 1)")
    how.add_argument("--level", type=float, default=0.95, metavar="P", help="of the intervals, a share (default 0.95)")
    how.add_argument(
        "--no-intervals", dest="intervals", action="store_false",
        help="leave the profiles out: the longest part of the work",
    )  # fmt: skip
    common.add_work(parser)


def run(arguments: argparse.Namespace) -> int:
    """Fit, print the tables, write the files."""
    from xb_muscle_ros.api.fitting import check_out, fit
    from xb_muscle_ros.fit.asked import number

    folder = check_out(arguments.out, arguments.overwrite)
    found = common.called(
        fit,
        arguments,
        arguments.bags,
        arguments.fiber,
        set=dict(arguments.changes),
        weight={name: number(value, f"--weight {name}") for name, value in _pairs(arguments.weight, "--weight")},
        tie=dict(_pairs(arguments.tie, "--tie")),
        bound={name: _range(value, f"--bound {name}") for name, value in _pairs(arguments.bound, "--bound")},
        prior={name: _range(value, f"--prior {name}") for name, value in _pairs(arguments.prior, "--prior")},
        journal=folder / "journal.jsonl",
        progress=True,
        tell=common.warn,
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
    from xb_muscle_ros.fit.asked import number

    low, colon, high = text.partition(":")
    if not colon:
        raise UserError(f"{where}={text}: needed are two numbers with a colon between them")
    return number(low, where), number(high, where)
