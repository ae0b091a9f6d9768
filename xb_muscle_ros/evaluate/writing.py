"""Results of an evaluation as files: JSON, text, tables, figures."""

from __future__ import annotations

from pathlib import Path

from xb_muscle_ros.evaluate.csv_rows import COLUMNS, tables
from xb_muscle_ros.evaluate.report import write_up
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.results import Results
from xb_muscle_ros.files import matching, write_json, write_text
from xb_muscle_ros.tables import write_csv
from xb_muscle_ros.trials.bag_files import remove_results

_FIGURES = ("force_rmsd", "relative_srs", "srs_surfaces")


def older_results(out: Path) -> list[Path]:
    """What an older evaluation left in a folder; not its journal, which holds what is computed already."""
    csv = ("trials", "force_rmsd", "relative_srs", "srs_cells", "srs_rmsd")
    return matching(out, r"evaluate\.(json|md)", rf"({'|'.join(csv)})\.csv", rf"({'|'.join(_FIGURES)})\.(png|pdf)")


def write(request: Request, results: Results) -> list[Path]:
    """Write all files of the results in the place of an older evaluation's; returns what to look at."""
    remove_results(older_results(request.out))
    return [*write_tables(request.out, results), *draw_figures(request.out, results)]


def write_tables(out: Path, results: Results) -> list[Path]:
    """Write ``evaluate.json``, ``evaluate.md`` and the CSV files."""
    write_json(out / "evaluate.json", results.sections)
    write_text(out / "evaluate.md", write_up(results.sections))
    written = [out / "evaluate.json", out / "evaluate.md"]
    for name, rows in tables(results).items():
        written.append(out / f"{name}.csv")
        write_csv(written[-1], rows, COLUMNS.get(name, ()))
    return written


def draw_figures(out: Path, results: Results) -> list[Path]:
    """Draw what there is to draw; PNG, and PDF beside it."""
    from xb_muscle_ros.evaluate.figures.force import draw_force
    from xb_muscle_ros.evaluate.figures.srs import draw_srs
    from xb_muscle_ros.evaluate.figures.surfaces import draw_surfaces

    force, profiles, surfaces = (out / f"{name}.png" for name in _FIGURES)
    made, found = [], results.sections
    if found.force_rmsd is not None and found.force_rmsd.overall:
        draw_force(force, found.force_rmsd)
        made.append(force)
    if results.data is not None and results.tables and found.srs is not None:
        made += [profiles] if draw_srs(profiles, results.data, results.tables, found.srs) else []
        made += [surfaces] if draw_surfaces(surfaces, results.data, results.tables) else []
    return made
