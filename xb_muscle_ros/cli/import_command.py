"""``xb_muscle import``: recordings of any lab become bags, one for each trial."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.units import KINDS, UNITS

if TYPE_CHECKING:
    from xb_muscle_ros.trials.readers.settings import ImportSettings

# Names of the readers; the readers themselves take time to load.
FORMATS = ("abf", "bag", "csv", "dat", "ddf", "mat", "slc", "sto", "xlsx")
# option: (key of the mapping and those above it, argument type, help)
_OPTIONS: dict[str, tuple[str, type, str]] = {
    "--trial": ("trial", str, "name of the trial (default: the file's)"),
    "--trial-column": ("columns.trial.column", str, "column whose value tells the trials of a table apart"),
    "--decimal": ("decimal", str, "'point' or 'comma' (default: what the table shows)"),
    "--encoding": ("encoding", str, "of a table's text, such as mac_roman (default: what its bytes show)"),
    "--header": ("header", str, "line of a table that names its columns, or 'none' (default: what the table shows)"),
    "--sheet": ("sheet", str, "sheet of a workbook (default: all, a trial each)"),
    "--longest-blank": (
        "blanks.longest",
        str,
        "runs of blank samples of a table up to this are filled (default: '2 ms')",
    ),
    "--fiber": ("fibre", str, "name of the fibre"),
    "--data-set": ("data_set", str, "begins the names of the bags (default: the fibre)"),
    "--source": ("source", str, "where the data come from, in words"),
    "--time-column": ("columns.time.column", str, "column of time, by its name or number"),
    "--rate": ("columns.time.rate", str, "samples in a second where no column tells the time: '1000 Hz'"),
    "--time-unit": ("columns.time.unit", str, "unit of time (default: what the table's header tells)"),
    "--length-column": ("columns.length.column", str, "column of length"),
    "--length-pattern": ("columns.length.pattern", str, "columns of length, one a trial: 'L_pCa(?P<pca>.+)'"),
    "--length-unit": (
        "columns.length.unit",
        str,
        "unit of length, or of volts a calibration: '0.1 mm/V'; default: as the table's header tells",
    ),
    "--length-is": ("columns.length.is", str, "'absolute' length (default) or 'change' from the reference length"),
    "--length-of": ("columns.length.of", str, "length of the 'fibre' (default), a 'sarcomere' or a 'half_sarcomere'"),
    "--reference-length": (
        "reference_length",
        str,
        "the length that is L0, for example '42.8 mm', or 'first_isometric' (default)",
    ),
    "--force-column": ("columns.force.column", str, "column of measured force or stress"),
    "--force-pattern": ("columns.force.pattern", str, "columns of force, one a trial: 'F_pCa(?P<pca>.+)'"),
    "--force-unit": (
        "columns.force.unit",
        str,
        "unit of force or stress, or of volts a calibration: '0.5 mN/V'; default: as the table's header tells",
    ),
    "--force-zero": (
        "columns.force.zero",
        str,
        "'as_recorded' (default), 'slack', or what the column reads without force: '0.12 V'",
    ),
    "--f0": ("f0", str, "the force or stress that is F0, for example '97 kPa'"),
    "--calcium-column": ("columns.calcium.column", str, "column of free calcium"),
    "--calcium-unit": ("columns.calcium.unit", str, "unit of calcium, or pCa"),
    "--pca": ("pca", float, "pCa of every file"),
    "--gear-ratio": ("gear_ratio", float, "of a lever: length is divided by it, force multiplied with it (ddf)"),
    "--amplitude": ("amplitude_l0", float, "amplitude of the conditioning stretch, L0"),
    "--recovery": ("recovery_s", float, "time between shortening and test stretch, s"),
}


DESCRIPTION = (
    "Make a bag of each trial. Columns and units come from a mapping file, from options, or from both; options go "
    "first. A bag that was made of the same file with the same mapping is kept, so a run that was stopped goes on "
    "where it was. A file that cannot be read is named and left out."
)
_BY_KIND = {name: " ".join(u for u, unit in UNITS.items() if unit.kind in KINDS[name]) for name in KINDS}
EPILOG = (
    f"Units of {'; '.join(f'{name}: {units}' for name, units in _BY_KIND.items())}. "
    "Exit code: 0 all is well, 1 some files were left out, 2 nothing was imported."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording, bag, or folder of such")
    parser.add_argument("--mapping", type=Path, metavar="YAML", help="columns, units and facts of the data set")
    parser.add_argument("--format", choices=FORMATS, help="format of the files (default: what each looks like)")
    common.add_out(parser, "folder of the bags", "bags")
    for option, (key, kind, text) in _OPTIONS.items():
        names = (option, "--fibre") if key == "fibre" else (option,)
        parser.add_argument(*names, type=kind, dest=key, metavar=option.rpartition("-")[2].upper(), help=text)
    parser.add_argument(
        "--isometric-scaling", action=argparse.BooleanOptionalAction,
        help="scale each trial's force to the isometric trial of its pCa (default: where the mapping has the table)",
    )  # fmt: skip
    parser.add_argument(
        "--notch", type=float, nargs="+", metavar="HZ",
        help="take hum of these frequencies out of length and force alike, without a shift in time: 50",
    )  # fmt: skip
    parser.add_argument("--strict", action="store_true", help="stop at the first file or trial that cannot be imported")


def run(args: argparse.Namespace) -> int:
    """Import the files one after another.

    Returns:
        0, 1 where some files or trials were left out, 2 where nothing was imported.

    Raises:
        UserError: a mapping or an option is wrong, or with ``--strict`` anything is.
    """
    from xb_muscle_ros.progress import Progress
    from xb_muscle_ros.trials.importing import Failed, FileDone, Kept, find_recordings, import_recordings, line_of

    settings = _settings(args)
    files = find_recordings(args.files, args.out)
    imported = kept = failed = 0
    with Progress(len(files), "import") as progress:
        for event in import_recordings(files, settings, args.out, args.overwrite):
            if isinstance(event, FileDone):
                progress.update()
            elif isinstance(event, Failed):
                if args.strict:
                    raise UserError(event.why)
                failed += 1
                progress.write(f"xb_muscle: error: {event.why}", file=sys.stderr)
            elif isinstance(event, Kept):
                kept += 1
                progress.write(f"{event.bag}: kept, made of the same file with the same mapping")
            else:
                imported += 1
                progress.write(f"{event.bag}: {line_of(event.trial)}")
                for warning in event.trial.warnings:
                    progress.write(f"  warning: {warning}")
    print(f"{imported} imported, {kept} kept, {failed} left out")
    return 0 if not failed else 1 if imported + kept else 2


def _settings(args: argparse.Namespace) -> ImportSettings:
    """The mapping file with the options put over it."""
    from xb_muscle_ros.trials.readers.mapping import load_mapping
    from xb_muscle_ros.trials.readers.settings import ImportSettings

    tree: dict[str, Any] = load_mapping(args.mapping) if args.mapping is not None else {}
    where = "options" if args.mapping is None else f"mapping {args.mapping}"
    overrides: dict[str, Any] = {}
    for key, _, _ in _OPTIONS.values():
        value = getattr(args, key)
        if value is None:
            continue
        branch, (*above, name) = overrides, key.split(".")
        for part in above:
            branch = branch.setdefault(part, {})
        branch[name] = value
    if args.notch is not None:
        overrides["notch"] = args.notch
    return ImportSettings(tree, where, args.format, args.isometric_scaling, overrides)
