"""``xb_muscle fit``: the parameters of a fibre from its recordings, and how well they are known."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xb_muscle_ros.fit.coordinates import Choice
    from xb_muscle_ros.fit.data import FitTrial
    from xb_muscle_ros.fit.problem import Problem
    from xb_muscle_ros.models.fibre_file import Fibre
    from xb_muscle_ros.trials.trial import Trial

# What a fit leaves beside the fibre file and its journal.
_WRITTEN = (r"fit\.json", r"trials(_\d+)?\.(png|pdf)", r"(features|profiles|correlation)\.(png|pdf)")
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
        "--no-anchor", action="store_true", help="do not ask for an isometric force of 1 F0 (SD 0.02) at pCa 4.5"
    )
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
    how.add_argument("--no-intervals", action="store_true", help="leave the profiles out: the longest part of the work")
    common.add_work(parser)


def run(arguments: argparse.Namespace) -> int:
    """Fit, print the tables, write the files."""
    from xb_muscle_ros.fit.figures.pages import draw
    from xb_muscle_ros.fit.report import as_json, write_fitted
    from xb_muscle_ros.fit.run import Settings, fit
    from xb_muscle_ros.fit.table import table
    from xb_muscle_ros.trials.bag_files import remove_results

    out = arguments.out
    if out.suffix not in (".yaml", ".yml"):
        raise UserError(f"--out is {out}; needed is the name of a fibre file, ending in .yaml")
    folder = out.with_suffix("")
    older = [*([out] if out.exists() else []), *matching(folder, *_WRITTEN)]
    refuse_older(older, arguments.overwrite)
    if not 0.5 <= arguments.level < 1.0:
        raise UserError(f"--level is {arguments.level:g}; allowed is 0.5 up to below 1")
    fibre = common.fibre_of(arguments, for_fit=True)
    trials = _trials(arguments, fibre)
    problem, notes = _problem(arguments, fibre, trials)
    for line in notes:
        common.warn(line)
    settings = Settings(arguments.starts, arguments.seed, None if arguments.no_intervals else arguments.level)
    fitted = fit(problem, settings, common.work_options_of(arguments, journal=folder / "journal.jsonl"))
    provenance = {
        "bags": [str(bag) for bag in arguments.bags],
        "fibre_of_trials": problem.fibre.name,
        "features": str(arguments.features) if arguments.features else None,
        "start": str(arguments.fiber),
        "split": {"hold_out": arguments.hold_out, "train": arguments.train, "preset": arguments.split},
        "json": f"{folder.name}/fit.json",
    }
    found = as_json(fitted, provenance, notes)
    print(table(found))
    for line in found["warnings"]:
        common.warn(line)
    remove_results(matching(folder, *_WRITTEN))
    write_json(folder / "fit.json", found)
    for path in draw(folder, fitted, found):
        print(path)
    write_fitted(out, fitted, found)
    print(folder / "fit.json")
    print(out)
    return 0


def _trials(arguments: argparse.Namespace, fibre: Fibre) -> list[Trial]:
    if not arguments.bags and arguments.features is None:
        raise UserError("nothing to fit to; give bags of trials, or --features")
    if not arguments.bags and arguments.features_of is None:
        raise UserError("without bags nobody knows whose features to fit; give --features-of")
    trials = common.study_of(arguments, fibre).trials if arguments.bags else []
    fibres = dict.fromkeys(trial.facts.fibre for trial in trials)
    if len(fibres) > 1:
        raise UserError(f"trials are of fibres {', '.join(fibres)}; fit one fibre at a time")
    return trials


def _problem(arguments: argparse.Namespace, given: Fibre, trials: list[Trial]) -> tuple[Problem, list[str]]:
    """The problem, and lines on what was taken for granted."""
    from xb_muscle_ros.fit.coordinates import fault_coordinates, free_names, parameter_coordinates, population_choices
    from xb_muscle_ros.fit.data import fit_trials
    from xb_muscle_ros.fit.features import F0_ANCHOR, Feature, measured
    from xb_muscle_ros.fit.problem import Problem
    from xb_muscle_ros.fit.split import held_out
    from xb_muscle_ros.fit.start import start_lines
    from xb_muscle_ros.models.fibre_file import load_fibre

    facts = [t.facts for t in trials]
    ties = dict(_pairs(arguments.tie, "--tie"))
    fibre, notes = _start(arguments, given, trials, ties)
    out = held_out(facts, arguments.hold_out, arguments.train, arguments.split)
    if arguments.split and not any(out):
        notes.append(f"--split {arguments.split} holds none of the trials out: all of them are fitted")
    weights = {name: _number(value, f"--weight {name}") for name, value in _pairs(arguments.weight, "--weight")}
    prepared = fit_trials(trials, out, arguments.window == "whole", weights)
    training = [t for t in prepared if not t.held_out and t.weight > 0.0]
    names, sds, lines = _nuisances(arguments.nuisance, training)
    notes += lines
    choices = _choices(arguments)
    if arguments.prior_fibers:
        others = [load_fibre(name, fibre.model, for_fit=True) for name in arguments.prior_fibers]
        free = free_names(fibre, arguments.free, arguments.fix, ties)
        mine, choices = set(choices), population_choices(others, choices, free)
        default = [name for name in free if name not in choices and name not in mine]
        if default:
            notes.append(f"--prior-fibers says nothing of {', '.join(default)}: default priors")
    coordinates = parameter_coordinates(fibre, arguments.free, arguments.fix, ties, choices)
    coordinates += fault_coordinates(names, [t.name for t in training], [t.solution for t in training], sds)
    features: tuple[Feature, ...] = () if arguments.no_anchor else (F0_ANCHOR,)
    if arguments.features is not None:
        whose = arguments.features_of or fibre.name
        features += measured(arguments.features, whose, not arguments.force_pca_only, notes.append)
    return Problem(fibre, prepared, coordinates, ties, features), [*start_lines(fibre), *notes]


def _start(
    arguments: argparse.Namespace, given: Fibre, trials: list[Trial], ties: dict[str, str]
) -> tuple[Fibre, list[str]]:
    """The fibre to start from, with name and constants of the one that was measured, and lines on these."""
    from dataclasses import replace

    from xb_muscle_ros.fit.start import begun, with_constants

    fibre = begun(given, arguments.free, arguments.fix, ties, dict(arguments.changes))
    fibre, lines = with_constants(fibre, [t.facts for t in trials])
    return replace(fibre, name=trials[0].facts.fibre if trials else arguments.features_of), lines


def _nuisances(given: list[str] | None, training: Sequence[FitTrial]) -> tuple[list[str], dict[str, float], list[str]]:
    """Names of measurement artefacts, SDs of those that the user gave one, and lines on what is left out."""
    from xb_muscle_ros.fit.ordinary import shown_by
    from xb_muscle_ros.measurement.faults import FAULTS

    ordinary, unseen = shown_by(training)
    sets: dict[str, Sequence[str]] = {"all": tuple(FAULTS), "ordinary": ordinary, "none": ()}
    names: list[str] = []
    sds: dict[str, float] = {}
    for text in ["ordinary"] if given is None else given:
        name, equals, sd = text.partition("=")
        if name in sets and equals:
            raise UserError(
                f"--nuisance {text}: '{name}' takes no SD, since each has its own unit; name them one by one"
            )
        if name == "none" and given is not None and len(given) > 1:
            raise UserError("--nuisance none is given with others; give it alone")
        if name in sds:
            raise UserError(f"--nuisance {name} is given an SD twice; give it once")
        names += sets.get(name, (name,))
        if equals:
            sds[name] = _number(sd, f"--nuisance {name}")
    left = [name for name in unseen if name not in names]
    asked = given is None or "ordinary" in given
    lines = (
        [f"not fitted, since nothing in the trials shows it: {', '.join(left)}"] if asked and left and training else []
    )
    return names, sds, lines


def _choices(arguments: argparse.Namespace) -> dict[str, Choice]:
    from dataclasses import replace

    from xb_muscle_ros.fit.coordinates import Choice

    made: dict[str, Choice] = {}
    for name, value in _pairs(arguments.bound, "--bound"):
        low, high = _range(value, f"--bound {name}")
        made[name] = replace(made.get(name, Choice()), lower=low, upper=high)
    for name, value in _pairs(arguments.prior, "--prior"):
        mean, sd = _range(value, f"--prior {name}")
        made[name] = replace(made.get(name, Choice()), prior_mean=mean, prior_sd=sd)
    return made


def _pairs(given: list[str], option: str) -> list[tuple[str, str]]:
    pairs = [text.partition("=") for text in given]
    for text, (name, _, value) in zip(given, pairs, strict=True):
        if not name or not value:
            raise UserError(f"{option} {text}: needed is NAME=VALUE")
        if sum(other == name for other, _, _ in pairs) > 1:
            raise UserError(f"{option} {name} is given more than once; give it once")
    return [(name, value) for name, _, value in pairs]


def _range(text: str, where: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    if not colon:
        raise UserError(f"{where}={text}: needed are two numbers with a colon between them")
    return _number(low, where), _number(high, where)


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise UserError(f"{where}: '{text}' is not a number") from None
    if value != value:
        raise UserError(f"{where}: '{text}' is not a number")
    return value
