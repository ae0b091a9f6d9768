"""A whole replay: all trials through the model or a node, records, table, files."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older, write_json
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.replay.report import Record, record, table, with_relative_srs
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bag_files import plain, remove_results
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Trial

Player = Callable[[Sequence[Trial], Fibre], Sequence[Simulated]]
"""Plays trials through a running node: `node.client.live.play_live`, or that with its options filled in."""


@dataclass(frozen=True)
class Replay:
    """Results of a replay, in the order of the trials.

    Attributes:
        fibre: parameters used.
        live: whether a node made the forces.
        simulated: one for each trial.
        records: entries of ``replay.json``.
        table: the same for the screen.
    """

    fibre: Fibre
    live: bool
    simulated: tuple[Simulated, ...]
    records: tuple[Record, ...]
    table: str


def replay(
    trials: Sequence[Trial],
    fibre: Fibre,
    live: Player | None = None,
    substeps: int = 1,
    settle_s: float | None = None,
) -> Replay:
    """Replay trials.

    Args:
        trials: at least one, names unique.
        live: plays the trials through a running node; None replays offline.
        substeps: see `simulate_trial`; offline only.
        settle_s: see `simulate_trial`; offline only.

    Raises:
        UserError: trial names repeat, or the node cannot be used.
        StateViolation: see `Muscle.step`.
    """
    names = [trial.facts.trial for trial in trials]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise UserError(
            f"trial name {repeated[0]} comes {names.count(repeated[0])} times; replay its bags in separate runs"
        )
    if live is not None:
        simulated = tuple(live(trials, fibre))
    else:
        muscle = Muscle(fibre)
        made = []
        with Progress(len(trials), "replay") as progress:
            for trial in trials:
                made.append(simulate_trial(muscle, trial, substeps, settle_s))
                progress.update()
        simulated = tuple(made)
    records = with_relative_srs([record(trial, one, fibre) for trial, one in zip(trials, simulated, strict=True)])
    how = "live, through muscle_node" if live is not None else "offline"
    title = f"fibre {fibre.name}, model {fibre.model}, method {fibre.method} ({how})"
    return Replay(fibre, live is not None, simulated, tuple(records), table(records, title))


def older_results(folder: Path) -> list[Path]:
    """What an older replay left in a folder: its table, its figures, and the bags that the table tells of."""
    files = matching(folder, r"replay\.json", r"replay(_\d+)?\.(png|pdf)")
    try:
        rows = json.loads((folder / "replay.json").read_text(encoding="utf-8"))["trials"]
        bags = [_bag(folder, str(row["trial"])) for row in rows]
    except (OSError, ValueError, KeyError, TypeError):
        bags = []
    return [*files, *(bag for bag in bags if bag.is_dir())]


def check_room(folder: Path, trials: Sequence[Trial], overwrite: bool) -> None:
    """Make sure that results may be written to a folder.

    Raises:
        UserError: an older replay is there and may not be replaced, or a bag that is of none; two trials would become
            one bag.
    """
    older = older_results(folder)
    refuse_older(older, overwrite)
    taken: dict[Path, str] = {}
    for trial in trials:
        bag = _bag(folder, trial.facts.trial)
        first = taken.setdefault(bag, trial.facts.trial)
        if first != trial.facts.trial:
            raise UserError(
                f"trials '{first}' and '{trial.facts.trial}' would both become bag {bag}; replay them in separate runs"
            )
        if bag.exists() and bag not in older:
            raise UserError(f"bag {bag} exists and is of no replay; choose another folder for --out")


def _bag(folder: Path, trial: str) -> Path:
    """A bag within the folder, whatever the trial is called."""
    return folder / "bags" / (plain(trial).lstrip(".-") or "_")


def write_results(folder: Path, trials: Sequence[Trial], results: Replay, live: Replay | None = None) -> list[Path]:
    """Write ``replay.json``, the figure and one simulated bag per trial in the place of an older replay's.

    Returns what to look at.

    Args:
        folder: made if need be.
        live: a second replay of the same trials, drawn on top.
    """
    from xb_muscle_ros.models.titles import title_of
    from xb_muscle_ros.replay.figure import draw_replay

    remove_results(older_results(folder))
    fibre = results.fibre
    tree = {"trials": results.records, "fibre": fibre.name, "model": fibre.model, "method": fibre.method}
    write_json(folder / "replay.json", {**tree, "live": results.live, "source": fibre.source})
    name = f"{title_of(results.fibre.model)} ({'live' if results.live else 'offline'})"
    pages = draw_replay(folder / "replay.png", trials, results.simulated, name, live.simulated if live else None)
    for trial, simulated in zip(trials, results.simulated, strict=True):
        write_trial(_bag(folder, trial.facts.trial), trial, simulated)
    return [folder / "replay.json", *pages]
