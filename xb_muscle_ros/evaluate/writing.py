"""Results of an evaluation as files: JSON, text, tables, figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.evaluate import sections
from xb_muscle_ros.evaluate.report import write_up
from xb_muscle_ros.evaluate.results import Request, Results
from xb_muscle_ros.evaluate.trials import MEASURED
from xb_muscle_ros.files import matching, write_json, write_text
from xb_muscle_ros.tables import write_csv
from xb_muscle_ros.trials.bag_files import remove_results


def older_results(out: Path) -> list[Path]:
    """What an older evaluation left in a folder; not its journal, which holds what is computed already."""
    tables = ("trials", "force_rmsd", "relative_srs", "srs_cells", "srs_rmsd")
    figures = ("force_rmsd", "relative_srs", "srs_surfaces")
    return matching(out, r"evaluate\.(json|md)", rf"({'|'.join(tables)})\.csv", rf"({'|'.join(figures)})\.(png|pdf)")


def write(request: Request, results: Results) -> list[Path]:
    """Write all files of the results in the place of an older evaluation's; returns what to look at."""
    remove_results(older_results(request.out))
    return [*write_tables(request.out, results), *draw_figures(request.out, results)]


def write_tables(out: Path, results: Results) -> list[Path]:
    """Write ``evaluate.json``, ``evaluate.md`` and the CSV files."""
    found = results.sections
    write_json(out / "evaluate.json", found)
    write_text(out / "evaluate.md", write_up(found))
    made = ["evaluate.json", "evaluate.md"]

    def table(name: str, rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> None:
        write_csv(out / name, columns, ([row[column] for column in columns] for row in rows))
        made.append(name)

    if results.trials is not None:
        table("trials.csv", sections.trial_rows(results.trials), sections.TRIAL_COLUMNS)
    if "force_rmsd" in found and found["force_rmsd"]["overall"]:
        table("force_rmsd.csv", sections.force_rows(found["force_rmsd"]), sections.FORCE_COLUMNS)
    if results.data is not None:
        table("relative_srs.csv", sections.relative_rows(results.tables, results.data), sections.RELATIVE_COLUMNS)
        cells = {MEASURED: results.data, **results.tables}
        table("srs_cells.csv", sections.cell_rows(cells), sections.CELL_COLUMNS)
    if "paper" in found:
        table("srs_rmsd.csv", found["paper"]["readings"], list(found["paper"]["readings"][0]))
    return [out / name for name in made]


def draw_figures(out: Path, results: Results) -> list[Path]:
    """Draw what there is to draw; PNG, and PDF beside it."""
    from xb_muscle_ros.evaluate.figures.force import draw_force
    from xb_muscle_ros.evaluate.figures.srs import draw_srs
    from xb_muscle_ros.evaluate.figures.surfaces import draw_surfaces

    made = []
    force = results.sections.get("force_rmsd", {})
    if force.get("overall"):
        made.append(out / "force_rmsd.png")
        draw_force(made[-1], force)
    if results.data is not None and results.tables:
        profiles, surfaces = out / "relative_srs.png", out / "srs_surfaces.png"
        made += [profiles] if draw_srs(profiles, results.data, results.tables, results.sections["srs"]) else []
        made += [surfaces] if draw_surfaces(surfaces, results.data, results.tables) else []
    return made
