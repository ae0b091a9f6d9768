"""A whole evaluation: recordings, the paper's grid, or both."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate import bags as bag_tasks
from xb_muscle_ros.evaluate import grid, more_scores, pairs_of_bags, sections
from xb_muscle_ros.evaluate.figures.srs import NOTHING_TO_DRAW, drawable
from xb_muscle_ros.evaluate.golden import GOLDEN, OURS, golden_sources
from xb_muscle_ros.evaluate.paper import Source, compare, readings_table
from xb_muscle_ros.evaluate.results import Request, Results
from xb_muscle_ros.evaluate.sets import file_serving, gather, served_line, value_lines
from xb_muscle_ros.evaluate.srs_scores import ALL_READINGS, READINGS
from xb_muscle_ros.evaluate.srs_table import SrsTable, read_table, read_tables
from xb_muscle_ros.evaluate.trials import MEASURED, Trials, duplicates, srs_table
from xb_muscle_ros.models.fibre_file import fibre_folders, find_fibre_file, load_fibre
from xb_muscle_ros.scores.enhancement import AFTER_S
from xb_muscle_ros.trials.bags import find_bags
from xb_muscle_ros.trials.completing import counted
from xb_muscle_ros.work import Options, run, stream

JOURNAL = "evaluate.journal"
_MAXIMAL_PCA = 4.5


def evaluate(request: Request, tell: Callable[[str], None] = lambda line: None) -> Results:
    """Compute everything; nothing but the journal is written.

    Args:
        request: what to do.
        tell: called with each line on a recording that cannot be used.

    Raises:
        UserError: a file, fibre, model or recording cannot be used; `work` cannot be done.
        StateViolation: see `Muscle.step`.
    """
    # Tables are read first: a fault in them shows before hours of work, and before the folder is made.
    data = read_table(request.empirical, "measured") if request.empirical is not None else None
    golden = read_tables(request.golden, GOLDEN) if request.golden is not None else {}
    results = Results({"sets": [], "force_pca": [], "k_tr": [], "residual_force_enhancement": []})
    if request.bags:
        _recordings(request, results, tell)
    if data is not None:
        _paper(request, results, data, golden)
    if results.data and results.tables and not drawable(results.data, results.tables, results.sections["srs"]):
        results.warnings.append(NOTHING_TO_DRAW)
    return results


def _work(request: Request, label: str) -> Options:
    return replace(request.work, journal=request.out / JOURNAL, label=label)


def _recordings(request: Request, results: Results, tell: Callable[[str], None]) -> None:
    found = find_bags(request.bags)
    files = _fibre_files(request.fibres)
    made = bag_tasks.tasks(
        found, files, request.models, request.method, request.settle_s, request.measured_only, request.known,
        request.only,
    )  # fmt: skip
    trials = results.trials = _of_bags(request, results, made)
    _settle_problems(request, trials, tell)
    results.warnings += trials.warnings
    if not request.measured_only:
        served = served_line(files, trials.fibres)
        results.warnings += [served] if served else []
        # Fibres without a file of their own may share one.
        named = list(dict.fromkeys(file_serving(files, name) for name in trials.fibres))
        results.models = gather(named, request.models, request.method)
        results.warnings += value_lines(results.models)
    found_sections = results.sections
    found_sections["sets"] = sections.sets_section(results.models)
    found_sections["trials"] = {
        "used": int(np.count_nonzero(trials.good)),
        "fibres": trials.fibres,
        "left_out": [trials.problems[bag] for bag in sorted(trials.problems)],
        "missing": {name: sorted(fibres) for name, fibres in sorted(trials.missing.items())},
    }
    found_sections["force_rmsd"] = sections.force_section(trials)
    found_sections["force_pca"] += more_scores.force_pca_of_trials(trials)
    found_sections["k_tr"] += more_scores.k_tr_rows(trials)
    _enhancement(request, results, made[0])
    found_sections["notes"] = sections.notes(trials, found_sections)
    results.warnings += found_sections["notes"]
    data = srs_table(trials, None, MEASURED)
    if data is not None:
        results.data = data
        for each in results.models:
            table = srs_table(trials, each.name, each.title) if each.name in trials.models else None
            if table is not None:
                results.tables[each.name] = table
        found_sections["srs"] = sections.srs_section(results.tables, data, results.models)
        results.warnings += sections.left_out_lines(found_sections["srs"])


def _of_bags(request: Request, results: Results, made: Sequence[Mapping[str, Any]]) -> Trials:
    """What the bags' trials show; a bag of several fibres has as many."""
    several: dict[int, list[dict[str, Any]]] = {}
    done: dict[int, Mapping[str, Any]] = {}
    lines: list[tuple[str, ...]] = []
    for index, one in stream(bag_tasks.evaluate_bag, made, _work(request, "recordings")):
        if "several" in one:
            several[index], line = bag_tasks.tasks_of_fibres(made[index], one)
            lines += [(line,)] if line is not None else []
        else:
            done[index] = one
    # One trial after the other in the order of the bags, whichever was ready first.
    places = [(index, k) for index in range(len(made)) for k in range(len(several.get(index, [0])))]
    trials = Trials(len(places))
    more = [(place, several[index][k]) for place, (index, k) in enumerate(places) if index in several]
    for place, (index, _) in enumerate(places):
        if index in done:
            trials.add(place, done[index])
            lines.append(tuple(done[index].get("notes", ())))
    if more:
        for i, one in stream(bag_tasks.evaluate_bag, [task for _, task in more], _work(request, "fibres")):
            trials.add(more[i][0], one)
            lines.append(tuple(one.get("notes", ())))
    results.warnings += counted(lines)
    return trials


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


def _settle_problems(request: Request, trials: Trials, tell: Callable[[str], None]) -> None:
    for index, problem in list(duplicates(trials)):
        trials.refuse(index, problem)
    problems = trials.problem_lines()
    if problems and not (request.skip_bad and np.any(trials.good)):
        if len(problems) == 1:
            raise UserError(problems[0])
        for problem in problems:
            tell(problem)
        raise UserError(
            f"{len(trials.problems)} of {len(trials.bag)} bags cannot be used; mend them, or leave them out with "
            "--skip-bad"
        )
    for problem in problems:
        tell(f"left out: {problem}")


def _enhancement(request: Request, results: Results, shared: dict[str, Any]) -> None:
    assert results.trials is not None
    pairs = more_scores.enhancement_pairs(results.trials)
    if not pairs:
        return
    made = [pairs_of_bags.enhancement_task(a, b, shared) for a, b in pairs]
    found = run(pairs_of_bags.evaluate_enhancement, made, _work(request, "force enhancement"))
    rows = more_scores.enhancement_rows(pairs, [dict(one) for one in found])
    results.sections["residual_force_enhancement"] += rows
    results.sections["enhancement_after_s"] = AFTER_S


def _paper(request: Request, results: Results, data: SrsTable, golden: Mapping[str, SrsTable]) -> None:
    fibres = list(request.fibres) or _package_fibres(data)
    models = gather(fibres, request.models, request.method)
    made = grid.tasks(models, settle_s=request.settle_s)
    found = [dict(one) for one in run(grid.simulate, made, _work(request, "paper's grid"))]
    tables: dict[str, SrsTable] = {}
    k_tr: dict[str, list[float]] = {}
    start = 0
    for each in models:
        end = start + len(each.fibres) * len(grid.PCAS)
        tables[each.name] = grid.table(each.title, list(each.fibres.values()), made[start:end], found[start:end])
        k_tr[each.name] = []
        problems = [one["k_tr_problem"] for one in found[start:end] if one["k_tr_problem"]]
        if problems:
            told = f"{each.name}: k_tr is left out for {len(problems)} of {end - start} fibres and pCa"
            results.warnings.append(f"{told}, the first because: {problems[0]}")
        for task, one in zip(made[start:end], found[start:end], strict=True):
            if one["k_tr"] is not None:
                row = {"fibre": task["fibre"]["name"], "trial": "simulated release", "pca": task["pca"]}
                results.sections["k_tr"].append({**row, "of": each.name, **one["k_tr"]})
                if task["pca"] == _MAXIMAL_PCA:
                    k_tr[each.name].append(one["k_tr"]["k_per_s"])
        start = end
    sources = [Source(OURS, tables, k_tr), *golden_sources(golden, models, tables)]
    results.models, results.tables, results.data = models, tables, data
    if "srs" in results.sections:
        results.sections["srs_of_recordings"] = results.sections.pop("srs")
    results.sections |= {
        "sets": sections.sets_section(models),
        "srs": sections.srs_section(tables, data, models),
        "paper": {
            "sources": [source.name for source in sources],
            "readings_shown": list(READINGS),
            "comparison": compare(sources, data, models),
            "readings": readings_table(sources, data, models, ALL_READINGS),
            "recordings": bool(request.bags),
        },
    }
    for label, table in [(MEASURED, data), *tables.items()]:
        results.sections["force_pca"] += more_scores.force_pca_of_table(table, label)


def _package_fibres(data: SrsTable) -> list[str]:
    known = {file.stem for folder in fibre_folders() for file in folder.glob("*.yaml")}
    names = [name for name in data.fibres if name in known]
    if not names:
        raise UserError(
            f"no fibre file for any of the measured fibres {', '.join(data.fibres)}; give fibre files with --fiber"
        )
    return names
