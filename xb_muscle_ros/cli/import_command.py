"""``xb_muscle import``: recordings in CSV or TSV become bags, one for each trial."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.mapping import ImportMapping, build_mapping, load_mapping
from xb_muscle_ros.trials.readers.units import KINDS, UNITS
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

# option: (key of the mapping, argument type, help)
_OPTIONS: dict[str, tuple[tuple[str, ...], type, str]] = {
    "--fiber": (("fibre",), str, "name of the fibre"),
    "--data-set": (("data_set",), str, "begins the names of the bags (default: the fibre)"),
    "--source": (("source",), str, "where the data come from, in words"),
    "--time-column": (("columns", "time", "column"), str, "column of time"),
    "--time-unit": (("columns", "time", "unit"), str, "its unit"),
    "--length-column": (("columns", "length", "column"), str, "column of length"),
    "--length-unit": (("columns", "length", "unit"), str, "its unit"),
    "--length-is": (
        ("columns", "length", "is"),
        str,
        "'absolute' length (default) or 'change' from the reference length",
    ),
    "--length-of": (("columns", "length", "of"), str, "length of the 'fibre' (default) or a 'half_sarcomere'"),
    "--reference-length": (
        ("reference_length",),
        str,
        "the length that is L0, for example '42.8 mm', or 'first_isometric' (default)",
    ),
    "--force-column": (("columns", "force", "column"), str, "column of measured force or stress"),
    "--force-unit": (("columns", "force", "unit"), str, "its unit"),
    "--f0": (("f0",), str, "the force or stress that is F0, for example '97 kPa'"),
    "--calcium-column": (("columns", "calcium", "column"), str, "column of free calcium"),
    "--calcium-unit": (("columns", "calcium", "unit"), str, "its unit"),
    "--pca": (("pca",), float, "pCa of every file"),
    "--amplitude": (("amplitude_l0",), float, "amplitude of the conditioning stretch, L0"),
    "--recovery": (("recovery_s",), float, "time between shortening and test stretch, s"),
}


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    units = "; ".join(
        f"{name}: {' '.join(u for u, unit in UNITS.items() if unit.kind in KINDS[name])}" for name in KINDS
    )
    parser = subparsers.add_parser(
        "import",
        help="make bags of recordings in CSV or TSV",
        description="Make a bag of each recording. Columns and units come from a mapping file, from options, or from "
        "both; options go first.",
        epilog=f"Units of {units}.",
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="CSV or TSV file with a header line")
    parser.add_argument("--mapping", type=Path, metavar="YAML", help="columns, units and facts of the data set")
    parser.add_argument(
        "--out", type=Path, default=Path("bags"), metavar="DIR", help="folder of the bags (default: bags)"
    )
    for option, (key, kind, text) in _OPTIONS.items():
        parser.add_argument(option, type=kind, dest=".".join(key), metavar=option.rpartition("-")[2].upper(), help=text)
    parser.add_argument(
        "--isometric-scaling",
        action=argparse.BooleanOptionalAction,
        help="scale each trial's force to the isometric trial of its pCa (default: where the mapping has the table)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace bags that exist")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Import the files; nothing is written unless all of them can be read.

    Raises:
        UserError: anything the user has to mend.
    """
    mapping = _mapping(args)
    trials = [(path, read_csv(path, mapping, args.isometric_scaling)) for path in args.files]
    bags = [args.out / bag_name(mapping.data_set, path.stem) for path in args.files]
    for i, bag in enumerate(bags):
        if bag in bags[:i]:
            raise UserError(
                f"{args.files[i]} and {args.files[bags.index(bag)]} would both become {bag}; import one at a time"
            )
        if bag.exists() and not args.overwrite:
            raise UserError(f"bag {bag} exists; use --overwrite to replace it or --out for another folder")
    for (_, trial), bag in zip(trials, bags, strict=True):
        write_trial(bag, trial)
        print(_line(bag, trial))
        for warning in trial.warnings:
            print(f"  warning: {warning}")
    return 0


def bag_name(data_set: str, trial: str) -> str:
    """Name of a trial's bag: data set and trial, in characters every file system and shell takes."""
    name = trial if trial.startswith(data_set) else f"{data_set}_{trial}"
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).lstrip(".-")


def _mapping(args: argparse.Namespace) -> ImportMapping:
    """The mapping file with the options put over it."""
    tree: dict[str, Any] = load_mapping(args.mapping) if args.mapping is not None else {}
    where = "options" if args.mapping is None else f"mapping {args.mapping}"
    for key, _, _ in _OPTIONS.values():
        value = getattr(args, ".".join(key))
        if value is None:
            continue
        branch = tree
        for part in key[:-1]:
            branch = branch.setdefault(part, {})
            if not isinstance(branch, dict):
                raise UserError(f"{where}: {part} is {branch!r}; needed are keys with values")
        branch[key[-1]] = value
    return build_mapping(tree, where)


def _line(bag: Path, trial: Trial) -> str:
    """One line on an imported trial."""
    facts = trial.facts
    parts = [
        f"{trial.time_s.size} samples",
        f"{trial.time_s[-1] - trial.time_s[0]:.3f} s",
        "pCa changes" if facts.pca is None else f"pCa {facts.pca:g}",
        f"L0 {facts.reference_length_m:.6g} m",
    ]
    if facts.amplitude_l0 is not None:
        parts.append(f"amplitude {100.0 * facts.amplitude_l0:g} % L0")
    if facts.recovery_s is not None:
        parts.append(f"recovery {facts.recovery_s:g} s")
    if trial.force_n.size:
        parts.append(f"force {np.min(trial.measured_f0):.3f} to {np.max(trial.measured_f0):.3f} F0")
    parts.append(" ".join(f"{phase.name}@{phase.start_s:.4f}" for phase in facts.phases))
    return f"{bag}: {', '.join(parts)}"
