"""Muscles of other packages beside ours through the paper's protocol: cost of a trial, and SRS beside the measured."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.bench import papers_trial
from xb_muscle_ros.bench.measure import Figure, Setting, machine
from xb_muscle_ros.bench.peers import mujoco_muscle, ours
from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.bench.peers.drawing import draw
from xb_muscle_ros.bench.peers.matching import activation_for
from xb_muscle_ros.bench.peers.muscle import Cost, Peer, PeerMuscle
from xb_muscle_ros.bench.peers.opensim_muscles import OpenSim, default_python
from xb_muscle_ros.bench.peers.rows import LEFT, Row, cost_text, milliseconds, peer_row, table
from xb_muscle_ros.bench.peers.scoring import Score, score_of
from xb_muscle_ros.bench.peers.simulating import simulate
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.fibre_cache import all_fibre_files
from xb_muscle_ros.evaluate.sets import ModelSet, gather
from xb_muscle_ros.evaluate.srs_table import SrsTable, place, read_table
from xb_muscle_ros.files import write_json, write_text
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.tables import markdown, number

MODELS = ("hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop")
_REPEATS = 21
# How the source of a set begins in a fibre file that was fitted to the features which are scored here.
_FITTED_HERE = "fitted by this package"


class Packages(NamedTuple):
    """Peers that can be had here.

    Attributes:
        peers: with the package that computes each, and its version.
        missing: one line for each package that is not here, with how to get it.
    """

    peers: Sequence[tuple[Peer, str]]
    missing: Sequence[str]


def study(setting: Setting) -> list[Figure]:
    """Fit, simulate, score and time; ``peers.md``, ``peers.json`` and the figure go beside the results.

    Raises:
        UserError: no measured table is given, it has no fibre that the package has, or a trial cannot be integrated.
    """
    if setting.empirical is None:
        raise UserError("study peers needs measured SRS: give --empirical empirical_srs.json (docs/evaluate.md)")
    data, models = measured(setting.empirical)
    with packages(default_python() if setting.peers_python is None else setting.peers_python) as found:
        for line in found.missing:
            Progress.write(f"xb_muscle: {line}", sys.stderr)
        rows, tables = compare(data, models, found.peers, setting)
    write_json(setting.out.with_name("peers.json"), {"machine": machine(), "fibres": list(data.fibres), "rows": rows})
    write_text(setting.out.with_name("peers.md"), markdown(*table(rows), left=LEFT) + "\n")
    draw(setting.drawing("peers"), data, tables, rows)
    return [figure for row in rows for figure in figures(row)]


def measured(path: FilePath) -> tuple[SrsTable, list[ModelSet]]:
    """The measured table, and our parameter sets, both of the fibres that have all the sets.

    Raises:
        UserError: there is none.
    """
    data = read_table(path, "measured")
    files = {file.stem for file in all_fibre_files()}
    known = [name for name in data.fibres if name in files]
    models = gather(known, MODELS, None) if known else []
    fibres = [name for name in known if all(name in each.fibres for each in models)]
    if not fibres:
        raise UserError(
            f"{path}: none of the fibres {', '.join(data.fibres)} has a file with the sets {', '.join(MODELS)}"
        )
    return data.only(fibres), models


@contextlib.contextmanager
def packages(python: FilePath) -> Iterator[Packages]:
    """Peers of the packages that are here; OpenSim's process ends with the block.

    Args:
        python: with OpenSim.
    """
    peers: list[tuple[Peer, str]] = []
    missing = []
    with contextlib.ExitStack() as stack:
        try:
            opensim = stack.enter_context(OpenSim(python))
            peers += [(peer, f"OpenSim {opensim.version}") for peer in opensim.peers()]
        except UserError as error:
            missing.append(f"rows of OpenSim are left out: {error}")
        try:
            found, version = mujoco_muscle.peers()
            peers += [(peer, f"MuJoCo {version}") for peer in found]
        except UserError as error:
            missing.append(f"the row of MuJoCo is left out: {error}")
        yield Packages(peers, missing)


def compare(
    data: SrsTable, models: Sequence[ModelSet], peers: Sequence[tuple[Peer, str]], setting: Setting
) -> tuple[list[Row], dict[str, SrsTable]]:
    """Rows in the order of the table, and simulated SRS by their keys.

    Raises:
        UserError, StateViolation: see `simulating.simulate` and `ours.simulate`.
    """
    fibres = list(data.fibres)
    # A trial is timed with one fibre's parameters; where the fibre asked for is not in the table, with the first's.
    timed = setting.fibre.name if setting.fibre.name in fibres else fibres[0]
    rows, tables = [], {}
    with Progress(len(fibres) * (len(peers) + len(models)), "peers") as progress:
        for peer, package in peers:
            found = simulate(peer, data, fibres, progress.update)
            tables[peer.key] = found.table
            if found.problems:
                line = f"{peer.key}: {len(found.problems)} trials are left out; {found.problems[0]}"
                Progress.write(f"xb_muscle: {line}", sys.stderr)
            costs = _cost(peer.take(found.values[timed]), data, timed)
            rows.append(peer_row(peer, package, found.values, score_of(found.table, data), costs))
        for each in models:
            tables[each.name] = ours.simulate(each, fibres, progress.update)
            costs = ours.cost(Muscle(each.fibres[timed]), _REPEATS)
            rows.append(_own_row(each, score_of(tables[each.name], data), costs))
    return rows, tables


def _cost(muscle: PeerMuscle, data: SrsTable, fibre: str) -> list[Cost]:
    """Of the paper's trial, at the activation that gives the fibre's isometric force."""
    level = place(data.pca, papers_trial.PCA)
    force = np.nan if level is None else float(data.isometric_f0(fibre)[level])
    if not np.isfinite(force):
        raise UserError(
            f"fibre {fibre}: its isometric force at pCa {papers_trial.PCA:g} is not known; take another with --fiber"
        )
    path = Path(*papers_trial.corners(), papers_trial.sample_s())
    return muscle.cost(activation_for(muscle, force), path, _REPEATS)


def _own_row(models: ModelSet, score: Score, costs: Sequence[Cost]) -> Row:
    fibre = next(iter(models.fibres.values()))
    how = "its SRS and force, here" if fibre.source.startswith(_FITTED_HERE) else "its force, by the paper's authors"
    return Row(
        models.name, models.title, "xb_muscle_ros", "elastic" if "kse" in fibre.values else "none",
        f"{models.fitted_parameters} parameters to {how}", {}, {}, 0, score, costs,
    )  # fmt: skip


def figures(row: Row) -> list[Figure]:
    """Cost and score as entries of ``bench.json``."""
    default, accurate = row.costs[0], row.costs[-1]
    spread = 5e2 * float(np.subtract(*np.percentile(accurate.seconds, [75, 25])))
    relative = row.score.relative["released"]
    others = f"small {number(relative['small'])}, all {number(relative['all'])}; {row.package}"
    made = [
        Figure(
            f"2.34 s trial, {row.name}", milliseconds(accurate), "ms",
            f"{accurate.integrator}, force error {100.0 * accurate.error_f0:.2g} % F0; by default {cost_text(default)}",
            spread,
        )
    ]  # fmt: skip
    if relative["large"] is not None:
        made.append(Figure(f"relative SRS over large reductions, {row.name}", relative["large"], "RMSD", others))
    return made
