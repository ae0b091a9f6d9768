"""Every mechanism and every pair of them on top of a model, judged by bathing solutions that were left out.

For each fibre of a folder (one folder a fibre, files named amp<1e-4 L0>_rt<ms>ms_pca<10 pCa>.csv with the columns
time_s, length_change_l0, force_f0) each set of mechanisms is fitted with ordinary measurement error (pCa shift per
solution, one time shift, force offsets); then each pCa but the lowest, which defines F0, is left out in turn and its
trials are predicted, their pCa shift taken from their isometric force alone. Singles come first; pairs start from the
singles' fits and run in the order of the singles' gains, and the table is written anew after each. A run that was
ended goes on where it was, if the journal is given again.
"""

from __future__ import annotations

import argparse
import functools
import itertools
import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_text
from xb_muscle_ros.fit.calibration import calibrated_force
from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.noise import Scale
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, Solution, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.registry import EXTRAS, SWAPS, row_of, split_set, with_mechanisms
from xb_muscle_ros.trials.corners import straight_pieces
from xb_muscle_ros.work import Options, run

Array = npt.NDArray[np.float64]

FAULT_SDS = {"pca_shift": 0.05, "time_shift": 7e-4, "force_offset": 3e-3}
# Residuals of 6 ms samples are autocorrelated over some 40 ms; 1.5 % F0 is a good fit's.
SCALE = Scale(0.015, 6.0)
# Time between samples given to the model, s, coarse and around corners (a time shift must not round them).
COARSE_S, FINE_S, FINE_REACH = 0.004, 0.00075, 6
FILE = re.compile(r"amp(\d+)_rt(\d+)ms_pca(\d+)")
MOST_PROCESSES = 2


def read(path: Path, order: int) -> FitTrial:
    """One file: force as recorded, length as straight pieces with exact corners.

    Raises:
        UserError: a name or a table of another form.
    """
    named = FILE.fullmatch(path.stem)
    if named is None:
        raise UserError(f"{path}: name not of the form amp<1e-4 L0>_rt<ms>ms_pca<10 pCa>.csv; rename or move the file")
    try:
        time, length, force = np.loadtxt(path, delimiter=",", skiprows=1).T
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: not three columns time_s, length_change_l0, force_f0 ({error}); mend it") from error
    pieces = straight_pieces(time, 1.0 + length, 1.0)
    corners = np.array([min(0.0, time[0]), *(p.start_s for p in pieces[1:]), time[-1]])
    rises = [
        p.line[0] * (b - a) if p.direction else 0.0
        for p, (a, b) in zip(pieces, itertools.pairwise(corners), strict=True)
    ]
    levels = float(length[0]) + np.concatenate([[0.0], np.cumsum(rises)])
    first = next((float(a) for a, p in zip(corners, pieces, strict=False) if p.direction), float(time[-1]))
    near = FINE_S * np.arange(-FINE_REACH, FINE_REACH + 1)
    wanted = np.concatenate([np.arange(first, time[-1], COARSE_S), *(c + near for c in corners[1:-1])])
    apart = np.min(np.abs(wanted[:, None] - corners[None, :]), axis=1) > 2e-4
    inside = (wanted > corners[0]) & (wanted < corners[-1]) & apart
    grid = np.unique(np.round(np.concatenate([corners, wanted[inside]]), 9))
    pca = int(named[3]) / 10.0
    return FitTrial(
        name=path.stem,
        solution=f"pCa {pca:g}",
        order=order,
        held_out=False,
        weight=1.0,
        steady_s=(float(time[0]), 0.8 * first),
        moves=True,
        time_s=grid,
        length_l0=np.interp(grid, corners, levels),
        calcium_um=np.full(grid.size, 10.0 ** (6.0 - pca)),
        force_time_s=time,
        measured_f0=force,
    )


def _problem(task: Mapping[str, Any]) -> Problem:
    """Priors are those of the released set and of the catalogue, wherever a fit starts."""
    fibre = load_fibre(task["fibre"], task["model"], for_fit=True)
    fibre = replace(fibre, values=MappingProxyType({**fibre.values, "smoothing": 0.0}))
    trials = tuple(FitTrial.from_json(row) for row in task["trials"])
    names, solutions = [t.name for t in trials], [t.solution for t in trials]
    faults = fault_coordinates(tuple(FAULT_SDS), names, solutions, FAULT_SDS)
    return Problem(fibre, trials, parameter_coordinates(fibre, None, (), {}, {}) + faults, {})


def _begin(problem: Problem, start: Mapping[str, float]) -> Array:
    """The point with these values, as near as bounds let it."""
    lower, upper = problem.bounds
    wanted = [
        c.inward(max(start[c.name], 1e-12) if c.log else start[c.name]) if c.group is None and c.name in start else z
        for c, z in zip(problem.coordinates, problem.start, strict=True)
    ]
    return np.clip(np.array(wanted), lower, upper)


def _descended(problem: Problem, z: Array, most: int, tolerance: float) -> Solution:
    return descend(Objective(Training(problem), SCALE), z, most=most, tolerance=tolerance)


def _without(problem: Problem, z: Array, solution: str) -> tuple[Problem, Array]:
    """The problem without a solution's trials and what is theirs alone, at the same point."""
    trials = tuple(replace(t, held_out=t.solution == solution) for t in problem.trials)
    gone = {solution, *(t.name for t in trials if t.held_out)}
    kept = [j for j, c in enumerate(problem.coordinates) if c.group not in gone]
    coordinates = tuple(problem.coordinates[j] for j in kept)
    return replace(problem, trials=trials, coordinates=coordinates), z[kept]


def case(task: dict[str, Any]) -> dict[str, Any]:
    """One set of mechanisms in one fibre: the best of its starts, then every solution left out in turn."""
    problem = _problem(task)
    descents = [_descended(problem, _begin(problem, start), 60, 1e-5) for start in task["starts"]]
    solution = min(descents, key=lambda s: s.cost)
    held: dict[str, list[float]] = {}
    for left_out in sorted({t.solution for t in problem.trials}, key=lambda s: float(s.removeprefix("pCa ")))[1:]:
        part, z = _without(problem, solution.z, left_out)
        fold = _descended(part, z, 25, 1e-4)
        squares, count = 0.0, 0
        for trial in (t for t in part.trials if t.held_out):
            calibrated = calibrated_force(part, fold.z, trial)
            if calibrated is None:
                raise UserError(f"fibre {task['fibre']}, {trial.name}: no isometric force to take its pCa shift from")
            squares += float(np.sum((calibrated[0] - trial.measured_f0) ** 2))
            count += trial.measured_f0.size
        held[left_out] = [squares, float(count)]
    values = {c.label: c.outward(float(v)) for c, v in zip(problem.coordinates, solution.z, strict=True)}
    return {"training_f0": solution.rmsd_f0, "cost": solution.cost, "held": held, "values": values}


def candidates(base: str) -> tuple[str, ...]:
    """Mechanisms that go with a model, alone."""
    found = []
    for name in (*EXTRAS, *SWAPS):
        try:
            split_set(with_mechanisms(base, name))
        except UserError:
            continue
        found.append(name)
    return tuple(found)


def goes_together(base: str, names: Sequence[str]) -> bool:
    """Whether a model takes these mechanisms at once: only one may put half-sarcomeres in series."""
    try:
        row_of(with_mechanisms(base, *names))
    except UserError:
        return False
    return True


def starts_of(names: Sequence[str], base: Mapping[str, float], singles: Mapping[str, Mapping[str, float]]) -> list[Any]:
    """Where a set starts: the catalogue's starts on the base's fit; for a pair, each single's fit and the other's."""
    if len(names) == 1:
        return [{**base, **start} for start in CATALOGUE[names[0]].starting_values(base)]
    found = []
    for first, second in (names, tuple(reversed(names))):
        own = {p: singles[second][p] for p in CATALOGUE[second].parameters}
        effect = CATALOGUE[second].effect
        # One that fitted to nothing begins where the catalogue would have it, or it would stay at nothing.
        if effect is not None and abs(own[effect]) < 0.02 * CATALOGUE[second].size:
            own = {**own, **CATALOGUE[second].starting_values(base)[0]}
        found.append({**singles[first], **own})
    return found


def pooled(rows: Sequence[Mapping[str, Any]]) -> float:
    """RMSD over all left-out samples, F0."""
    held = [pair for row in rows for pair in row["held"].values()]
    return math.sqrt(sum(s for s, _ in held) / sum(n for _, n in held))


def table(fibres: Sequence[str], base: str, found: Mapping[tuple[str, ...], Sequence[Mapping[str, Any]]]) -> str:
    """Markdown: left-out RMSD (% F0) by set and fibre, best first."""
    reference = pooled(found[()])
    lines = [
        f"| on top of `{base}` | " + " | ".join(fibres) + " | all | of base | fitted |",
        "|---" * (len(fibres) + 4) + "|",
    ]
    for names in sorted(found, key=lambda names: pooled(found[names])):
        rows = found[names]
        fitted = math.sqrt(float(np.mean([row["training_f0"] ** 2 for row in rows])))
        cells = [*(pooled([row]) for row in rows), pooled(rows)]
        lines.append(
            f"| {' + '.join(f'`{name}`' for name in names) or 'nothing'} | "
            + " | ".join(f"{100.0 * cell:.2f}" for cell in cells)
            + f" | {pooled(rows) / reference:.2f} | {100.0 * fitted:.2f} |"
        )
    return "\n".join(lines) + "\n"


class Comparison:
    """Sets of mechanisms fitted so far, and the table of them."""

    def __init__(self, trials: Mapping[str, list[Any]], base: str, out: Path) -> None:
        self._trials, self._base, self._out = trials, base, out
        self.found: dict[tuple[str, ...], list[dict[str, Any]]] = {}

    def fit(self, sets: Sequence[tuple[str, ...]], options: Options) -> None:
        """Fit sets in all fibres at once, and write the table."""
        tasks = [
            {"fibre": fibre, "model": with_mechanisms(self._base, *names), "trials": trials, "starts": starts}
            for names in sets
            for k, (fibre, trials) in enumerate(self._trials.items())
            for starts in [self._starts(names, k)]
        ]
        rows = run(case, tasks, options)
        count = len(self._trials)
        for i, names in enumerate(sets):
            self.found[names] = list(rows[i * count : (i + 1) * count])
        write_text(self._out, table(tuple(self._trials), self._base, self.found))

    def gain(self, names: tuple[str, ...]) -> float:
        """Left-out RMSD over that of the base; less is better."""
        return pooled(self.found[names]) / pooled(self.found[()])

    def _starts(self, names: tuple[str, ...], k: int) -> list[Any]:
        if not names:
            return [{}]
        values = {key: _parameters(rows[k]["values"]) for key, rows in self.found.items()}
        return starts_of(names, values[()], {key[0]: v for key, v in values.items() if len(key) == 1})


def _parameters(values: Mapping[str, float]) -> dict[str, float]:
    """Values of model parameters, without those of faults."""
    return {label: v for label, v in values.items() if label.partition("[")[0] not in FAULT_SDS}


def main(given: argparse.Namespace) -> None:
    """Fit all sets and write the table."""
    folders = sorted(path for path in given.folder.iterdir() if path.is_dir()) if given.folder.is_dir() else []
    chosen = [path for path in folders if not given.fiber or path.name in given.fiber]
    if not chosen:
        raise UserError(f"{given.folder}: no folders of fibres; give rat_soleus_fibres, or names with --fiber")
    trials = {
        path.name: [read(file, k).to_json() for k, file in enumerate(sorted(path.glob("*.csv")))] for path in chosen
    }
    names = given.mechanisms or candidates(given.base)
    processes = min(given.processes, MOST_PROCESSES)
    make = functools.partial(Options, processes=processes, journal=given.journal)
    comparison = Comparison(trials, given.base, given.out)
    comparison.fit([()], make(label="base"))
    for name in names:
        comparison.fit([(name,)], make(label=name))
    pairs = [p for p in itertools.combinations(names, 2) if goes_together(given.base, p)]
    pairs.sort(key=lambda p: comparison.gain((p[0],)) * comparison.gain((p[1],)))
    for k, pair in enumerate(pairs, 1):
        comparison.fit([pair], make(label=f"pair {k} of {len(pairs)}: {' + '.join(pair)}"))
    print(given.out.read_text(encoding="utf-8"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="one folder a fibre, such as rat_soleus_fibres")
    parser.add_argument("--base", default="3state_coop", help="model that the mechanisms come on top of")
    parser.add_argument("--fiber", nargs="+", help="fibres to take; default: all")
    parser.add_argument("--mechanisms", nargs="+", help="mechanisms to try; default: all that go with the model")
    parser.add_argument("--processes", type=int, default=1, help=f"1 or {MOST_PROCESSES}")
    parser.add_argument("--journal", type=Path, help="file that keeps finished fits")
    parser.add_argument("--out", type=Path, default=Path("pairs.md"), help="table, written after every set")
    try:
        main(parser.parse_args())
    except UserError as error:
        sys.exit(f"compare_pairs: {error}")
