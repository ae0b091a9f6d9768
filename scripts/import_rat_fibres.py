"""Import the rat soleus fibres at the paper's two fitted protocols: one folder of bags for each fibre.

SOURCE has a folder for each fibre with a CSV file for each trial (time_s, length_change_l0, force_f0 every 6 ms; pCa,
amplitude and recovery in the file's name); bags go to OUT/<fibre>/<fibre>_<trial>. Nothing is imported twice.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.importing import Failed, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings

MAPPING = Path(__file__).parent / "datasets" / "rat_soleus_fibres.yaml"


def main() -> int:
    """Import what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=Path, metavar="SOURCE", help="folder of fibres")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder of the bags")
    parser.add_argument("--fiber", nargs="+", metavar="NAME", help="these alone (default: all)")
    given = parser.parse_args()
    try:
        for name, bags in import_fibres(given.source, given.out, given.fiber):
            print(f"{given.out / name}: {bags} bags")
    except UserError as error:
        print(f"{parser.prog}: error: {error}", file=sys.stderr)
        return 1
    return 0


def import_fibres(source: Path, out: Path, names: list[str] | None = None) -> Iterator[tuple[str, int]]:
    """Import fibre by fibre; yields the name of each and the number of its bags.

    Args:
        source: folder with a folder of CSV files for each fibre.
        out: folder of the bags, made if need be; those of a fibre go to a folder of its name.
        names: of the fibres; None for all.

    Raises:
        UserError: no such folder or fibre, or a file that cannot be imported.
    """
    there = sorted(folder.name for folder in source.iterdir() if any(folder.glob("*.csv"))) if source.is_dir() else []
    if not there:
        raise UserError(f"{source} has no folder of CSV files; give the folder of rat_soleus_fibres")
    for name in names or there:
        if name not in there:
            raise UserError(f"{source} has no fibre '{name}'; there are {', '.join(there)}")
    tree = load_mapping(MAPPING)
    for name in names or there:
        settings = ImportSettings(tree, f"mapping {MAPPING}", overrides={"fibre": name})
        files = sorted((source / name).glob("*.csv"))
        for event in import_recordings(files, settings, out / name):
            if isinstance(event, Failed):
                raise UserError(event.why)
        yield name, len(files)


if __name__ == "__main__":
    sys.exit(main())
