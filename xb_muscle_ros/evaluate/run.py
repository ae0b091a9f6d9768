"""A whole evaluation: recordings, the paper's grid, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate import bags as bag_tasks
from xb_muscle_ros.evaluate import grid
from xb_muscle_ros.evaluate.curves import RedevelopmentRow, force_pca_of_table, force_pca_of_trials, redevelopment_rows
from xb_muscle_ros.evaluate.enhancement import (
    EnhancementRow,
    enhancement_pairs,
    enhancement_rows,
    enhancement_task,
    evaluate_enhancement,
)
from xb_muscle_ros.evaluate.fibre_cache import all_fibre_files
from xb_muscle_ros.evaluate.figures.srs import NOTHING_TO_DRAW, drawable
from xb_muscle_ros.evaluate.force_scores import force_scores
from xb_muscle_ros.evaluate.golden import GOLDEN, OURS, golden_sources
from xb_muscle_ros.evaluate.paper import Source, paper_section
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.results import Results, Sections
from xb_muscle_ros.evaluate.sections import TrialsSection, left_out_lines, notes, sets_section, srs_section
from xb_muscle_ros.evaluate.sets import file_serving, gather, served_line, value_lines
from xb_muscle_ros.evaluate.srs_table import SrsTable, read_table, read_tables
from xb_muscle_ros.evaluate.trials import MEASURED, Evaluated, Trials, srs_table
from xb_muscle_ros.models.fibre_file import find_fibre_file, load_fibre
from xb_muscle_ros.scores.enhancement import AFTER_S
from xb_muscle_ros.trials.bags import find_bags
from xb_muscle_ros.trials.completing import counted
from xb_muscle_ros.work import Options, run, stream
from xb_muscle_ros.work.plain import from_plain

JOURNAL = "evaluate.journal"
_MAXIMAL_PCA = 4.5


def evaluate(request: Request, tell: Callable[[str], None] = lambda line: None) -> Results:
    """Compute everything; nothing but the journal is written.

    Args:
        tell: called with each line on a recording that cannot be used.

    Raises:
        UserError: a file, fibre, model or recording cannot be used; `work` cannot be done.
        StateViolation: see `Muscle.step`.
    """
    # Tables are read first: an error in them shows before hours of work, and before the folder is made.
    data = read_table(request.empirical, MEASURED) if request.empirical is not None else None
    golden = read_tables(request.golden, GOLDEN) if request.golden is not None else {}
    results = _recordings(request, tell) if request.bags else Results(Sections())
    if data is not None:
        results = _with_paper(request, results, data, golden)
    srs = results.sections.srs
    if srs is not None and results.data and results.tables and not drawable(results.data, results.tables, srs):
        results = replace(results, warnings=[*results.warnings, NOTHING_TO_DRAW])
    return results


def _work(request: Request, label: str) -> Options:
    return replace(request.work, journal=request.out / JOURNAL, label=label)


def _recordings(request: Request, tell: Callable[[str], None]) -> Results:
    files = _fibre_files(request.fibres)
    made = bag_tasks.tasks(request, find_bags(request.bags), files)
    found, warnings = _of_bags(request, made)
    trials = Trials(found)
    _tell_problems(request, trials, tell)
    warnings += trials.warnings
    models = []
    if not request.measured_only:
        served = served_line(files, trials.fibres)
        # Fibres without a file of their own may share one.
        named = list(dict.fromkeys(file_serving(files, name) for name in trials.fibres))
        models = gather(named, request.models, request.method)
        warnings += [*([served] if served else []), *value_lines(models)]
    left_out = [trials.problems[bag] for bag in sorted(trials.problems)]
    curves, enhancements = force_pca_of_trials(trials), _enhancements(request, trials, made[0])
    told = notes(trials, curves, enhancements)
    warnings += told
    tables: dict[str, SrsTable] = {}
    srs = None
    data = srs_table(trials, MEASURED, MEASURED)
    if data is not None:
        made_of = {each.name: srs_table(trials, each.name, each.title) for each in models if each.name in trials.models}
        tables = {name: table for name, table in made_of.items() if table is not None}
        srs = srs_section(tables, data, models)
        warnings += left_out_lines(srs)
    sections = Sections(
        sets=sets_section(models),
        trials=TrialsSection(int(np.count_nonzero(trials.good)), trials.fibres, left_out, trials.missing),
        force_rmsd=force_scores(trials),
        srs=srs,
        force_pca=curves,
        k_tr=redevelopment_rows(trials),
        residual_force_enhancement=enhancements,
        enhancement_after_s=AFTER_S if enhancements else None,
        notes=told,
    )
    return Results(sections, warnings, trials, tables, data)


def _of_bags(request: Request, made: Sequence[Mapping[str, Any]]) -> tuple[list[Evaluated], list[str]]:
    """What the bags' trials show in the order of the bags, whichever was ready first, and lines on their facts.

    A bag of several fibres has as many trials.
    """

    def all_of(tasks: Sequence[Mapping[str, Any]], label: str) -> list[Evaluated]:
        found = stream(bag_tasks.evaluate_bag, tasks, _work(request, label))
        of = {index: from_plain(Evaluated, row) for index, row in found}
        return [of[index] for index in range(len(tasks))]

    whole = all_of(made, "recordings")
    parts = {k: bag_tasks.tasks_of_fibres(made[k], one.several) for k, one in enumerate(whole) if one.several}
    more = [task for tasks, _ in parts.values() for task in tasks]
    rest = iter(all_of(more, "fibres") if more else [])
    found: list[Evaluated] = []
    for k, one in enumerate(whole):
        found += [next(rest) for _ in parts[k][0]] if k in parts else [one]
    lines = [(line,) for _, line in parts.values() if line is not None]
    return found, counted([*lines, *(tuple(one.notes) for one in found)])


def _fibre_files(given: Sequence[str]) -> dict[str, Path] | None:
    """Fibre files by the fibre's name; None where none are given."""
    files: dict[str, Path] = {}
    for name in given:
        path = find_fibre_file(name)
        fibre = load_fibre(path).name
        if fibre in files:
            raise UserError(f"fibre {fibre} is given twice, by {files[fibre]} and {path}; give each once")
        files[fibre] = path
    return files or None


def _tell_problems(request: Request, trials: Trials, tell: Callable[[str], None]) -> None:
    problems = trials.problem_lines()
    if problems and not (request.skip_bad and np.any(trials.good)):
        if len(problems) == 1:
            raise UserError(problems[0])
        for problem in problems:
            tell(problem)
        raise UserError(
            f"{len(trials.problems)} of {len(trials.found)} bags cannot be used; mend them, or leave them out with "
            "--skip-bad"
        )
    for problem in problems:
        tell(f"left out: {problem}")


def _enhancements(request: Request, trials: Trials, shared: dict[str, Any]) -> list[EnhancementRow]:
    pairs = enhancement_pairs(trials)
    if not pairs:
        return []
    tasks = [enhancement_task(pair, shared) for pair in pairs]
    found = run(evaluate_enhancement, tasks, _work(request, "force enhancement"))
    return [row for pair, result in zip(pairs, found, strict=True) for row in enhancement_rows(pair, result)]


def _with_paper(request: Request, before: Results, data: SrsTable, golden: Mapping[str, SrsTable]) -> Results:
    """The paper's grid, beside what recordings gave before."""
    models = gather(list(request.fibres) or _package_fibres(data), request.models, request.method)
    made = grid.tasks(models, settle_s=request.settle_s)
    found = iter(zip(made, run(grid.simulate, made, _work(request, "paper's grid")), strict=True))
    tables: dict[str, SrsTable] = {}
    k_tr: dict[str, list[float]] = {}
    rates: list[RedevelopmentRow] = []
    warnings = list(before.warnings)
    for each in models:
        of_set = [next(found) for _ in range(len(each.fibres) * len(grid.PCAS))]
        tasks, cells = [task for task, _ in of_set], [from_plain(grid.Cells, row) for _, row in of_set]
        tables[each.name] = grid.table(each.title, list(each.fibres.values()), tasks, cells)
        problems = [cell.k_tr.why for cell in cells if cell.k_tr.why]
        if problems:
            told = f"{each.name}: k_tr is left out for {len(problems)} of {len(cells)} fibres and pCa"
            warnings.append(f"{told}, the first because: {problems[0]}")
        known = [
            RedevelopmentRow(task["fibre"]["name"], "simulated release", task["pca"], each.name, *cell.k_tr)
            for task, cell in zip(tasks, cells, strict=True)
            if cell.k_tr.value is not None
        ]
        rates += known
        k_tr[each.name] = [row.k_per_s for row in known if row.pca == _MAXIMAL_PCA and row.k_per_s is not None]
    sources = [Source(OURS, tables, k_tr), *golden_sources(golden, models, tables)]
    curves = [row for label, table in [(MEASURED, data), *tables.items()] for row in force_pca_of_table(table, label)]
    sections = replace(
        before.sections,
        sets=sets_section(models),
        srs=srs_section(tables, data, models),
        srs_of_recordings=before.sections.srs,
        paper=paper_section(sources, data, models, bool(request.bags)),
        force_pca=[*before.sections.force_pca, *curves],
        k_tr=[*before.sections.k_tr, *rates],
    )
    return replace(before, sections=sections, warnings=warnings, tables=tables, data=data)


def _package_fibres(data: SrsTable) -> list[str]:
    known = {file.stem for file in all_fibre_files()}
    names = [name for name in data.fibres if name in known]
    if not names:
        raise UserError(
            f"no fibre file for any of the measured fibres {', '.join(data.fibres)}; give fibre files with --fiber"
        )
    return names
